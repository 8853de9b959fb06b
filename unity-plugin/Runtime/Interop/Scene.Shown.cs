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

        /// <summary>Displacement of the attached points at the last state.</summary>
        public void ReadPoints(float* output, int floats)
        {
            IntPtr scene = Enter();
            try { Status.Check(Native.upt_scene_read_points(scene, output, checked((ulong)floats))); }
            finally { Leave(); }
        }

        /// <summary>Displacement of the attached points between the last two states. The pointer may be a
        /// <c>NativeArray</c>'s.</summary>
        public void SamplePoints(double alpha, float* output, int floats)
        {
            IntPtr scene = Enter();
            try { Status.Check(Native.upt_scene_sample_points(scene, alpha, output, checked((ulong)floats))); }
            finally { Leave(); }
        }

        /// <summary>Displacement of the attached points <paramref name="seconds"/> after the last published step, with the first
        /// <paramref name="count"/> instruments where they are then. Throws <c>UPT_ERR_UNSUPPORTED</c> where the scene does not
        /// correct. The pointer may be a <c>NativeArray</c>'s.</summary>
        public void PresentPoints(double seconds, upt_instrument[] instruments, int count, float* output, int floats)
        {
            RequireInstruments(instruments, count);
            IntPtr scene = Enter();
            try
            {
                fixed (upt_instrument* i = instruments)
                    Status.Check(Native.upt_scene_present_points(scene, seconds, i, (ulong)count, output,
                                                                 checked((ulong)floats)));
            }
            finally { Leave(); }
        }

        /// <summary>The same in the region's order.</summary>
        public void Present(double seconds, upt_instrument[] instruments, int count, float[] output)
        {
            RequireInstruments(instruments, count);
            IntPtr scene = Enter();
            try
            {
                fixed (upt_instrument* i = instruments)
                fixed (float* o = output)
                    Status.Check(Native.upt_scene_present(scene, seconds, i, (ulong)count, o, Length(output)));
            }
            finally { Leave(); }
        }

        /// <summary>As <see cref="Present"/>, with the first <paramref name="count"/> entries of a contact list, where the nodes are
        /// then, in place of instruments.</summary>
        public void PresentContacts(double seconds, uint[] nodes, float[] vectors, int count, float[] output)
        {
            RequireContacts(nodes, vectors, count);
            IntPtr scene = Enter();
            try
            {
                fixed (uint* n = nodes)
                fixed (float* v = vectors)
                fixed (float* o = output)
                    Status.Check(Native.upt_scene_present_contacts(scene, seconds, n, v, (ulong)count, o, Length(output)));
            }
            finally { Leave(); }
        }

        /// <summary>The same at the attached points. The pointer may be a <c>NativeArray</c>'s.</summary>
        public void PresentPointsContacts(double seconds, uint[] nodes, float[] vectors, int count, float* output, int floats)
        {
            RequireContacts(nodes, vectors, count);
            IntPtr scene = Enter();
            try
            {
                fixed (uint* n = nodes)
                fixed (float* v = vectors)
                    Status.Check(Native.upt_scene_present_points_contacts(scene, seconds, n, v, (ulong)count, output,
                                                                          checked((ulong)floats)));
            }
            finally { Leave(); }
        }
    }
}
