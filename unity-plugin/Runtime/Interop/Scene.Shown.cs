using System;

namespace Upt.Interop
{
    // What is shown between the steps: frames, and points of the host's own that move with the tissue.
    public sealed unsafe partial class Scene
    {
        /// <summary>Attaches points of the rest volume (a render mesh's vertices; <c>[n,3]</c> mm), or
        /// detaches them with null.</summary>
        public void AttachPoints(float[] points)
        {
            if (points != null && points.Length % 3 != 0)
                throw new ArgumentException("points hold " + points.Length + " floats, which is not a multiple of 3",
                                            "points");
            IntPtr scene = Enter();
            try
            {
                fixed (float* p = points)
                    Status.Check(
                        Native.upt_scene_attach_points(scene, p, points == null ? 0 : (ulong)points.Length / 3));
            }
            finally { Leave(); }
            PointCount = points == null ? 0 : points.Length / 3;
        }

        /// <summary>The last published displacement of the region or of the attached points (<c>UPT_VIEW_*</c>).
        /// The pointer may be a <c>NativeArray</c>'s.</summary>
        public void Read(upt_view_kind view, float* output, int floats)
        {
            upt_view shown = ViewOf(view);
            IntPtr scene = Enter();
            try { Status.Check(Native.upt_scene_read(scene, &shown, output, checked((ulong)floats))); }
            finally { Leave(); }
        }

        /// <summary>The last published displacement, in the region's order.</summary>
        public void Read(float[] output)
        {
            fixed (float* o = output)
                Read(Native.UPT_VIEW_REGION, o, output == null ? 0 : output.Length);
        }

        /// <summary>Displacement between the state before (<paramref name="alpha"/> = 0) and the last state (1), of the
        /// region or of the attached points (<c>UPT_VIEW_*</c>). The pointer may be a <c>NativeArray</c>'s.</summary>
        public void Sample(double alpha, upt_view_kind view, float* output, int floats)
        {
            upt_view shown = ViewOf(view);
            IntPtr scene = Enter();
            try { Status.Check(Native.upt_scene_sample(scene, alpha, &shown, output, checked((ulong)floats))); }
            finally { Leave(); }
        }

        /// <summary>The same in the region's order.</summary>
        public void Sample(double alpha, float[] output)
        {
            fixed (float* o = output)
                Sample(alpha, Native.UPT_VIEW_REGION, o, output == null ? 0 : output.Length);
        }

        /// <summary>Displacement of any nodes, computed now from the latest state.</summary>
        public void Decode(uint[] nodes, float[] output)
        {
            if (nodes == null) throw new ArgumentNullException("nodes");
            upt_view shown = ViewOf(Native.UPT_VIEW_NODES);
            IntPtr scene = Enter();
            try
            {
                fixed (uint* n = nodes)
                fixed (float* o = output)
                {
                    shown.nodes = n;
                    shown.node_count = (ulong)nodes.Length;
                    Status.Check(Native.upt_scene_decode(scene, &shown, o, Length(output)));
                }
            }
            finally { Leave(); }
        }

        static upt_view ViewOf(upt_view_kind kind)
        {
            upt_view shown = default(upt_view);
            shown.struct_size = (uint)sizeof(upt_view);
            shown.kind = kind;
            return shown;
        }

        /// <summary>Displacement at <paramref name="when"/>, between steps, with the instruments or nodes of
        /// <paramref name="input"/> where they are then: of the region, of the attached points, or of the vertices of the
        /// surface (<c>UPT_VIEW_*</c>). The moment is on the clock of the steps' times, or without one the time since the last
        /// published step, s. Throws <c>UPT_ERR_UNSUPPORTED</c> where the scene does not correct. The pointer may be a
        /// <c>NativeArray</c>'s.</summary>
        public void Present(StepInput input, double when, upt_view_kind view, float* output, int floats)
        {
            input.Require(NodeCount);
            upt_view shown = ViewOf(view);
            IntPtr scene = Enter();
            try
            {
                upt_pressure* p = stackalloc upt_pressure[PinnedLists.MostPressures];
                upt_support* g = stackalloc upt_support[PinnedLists.MostGroups];
                using (PinnedLists pins = new PinnedLists(input, p, g))
                fixed (upt_instrument* i = input.Instruments)
                fixed (uint* n = input.ContactNodes)
                fixed (float* v = input.ContactVectors)
                fixed (float* c = input.Collision)
                fixed (float* u = input.Displacement)
                fixed (float* f = input.Forces)
                fixed (upt_tie* t = input.Ties)
                fixed (upt_point_force* q = input.PointForces)
                {
                    upt_input raw = input.Raw(i, n, v, c, u, f, p, t, g, q);
                    Status.Check(Native.upt_scene_present(scene, &raw, when, &shown, output, checked((ulong)floats)));
                }
            }
            finally { Leave(); }
        }

        /// <summary>The same in the region's order.</summary>
        public void Present(StepInput input, double when, float[] output)
        {
            fixed (float* o = output)
                Present(input, when, Native.UPT_VIEW_REGION, o, output == null ? 0 : output.Length);
        }
    }
}
