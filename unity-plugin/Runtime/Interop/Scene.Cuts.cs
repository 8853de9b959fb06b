using System;

namespace Upt.Interop
{
    /// <summary>The closed surface of a scene's body, and what of it is new since it was asked for before.</summary>
    public sealed class CutSurface
    {
        /// <summary><c>[v,3]</c>, mm: where each vertex lies in the tissue at rest, for textures. The first are the mesh's
        /// nodes.</summary>
        public float[] Rest = new float[0];

        /// <summary><c>[t,3]</c>, outward; 0, 0, 0 in slots that are empty.</summary>
        public uint[] Triangles = new uint[0];

        /// <summary><c>[t]</c>: 1 where the triangle was inside of the intact body: it gets the inside material.</summary>
        public byte[] Inside = new byte[0];

        /// <summary>Slots of triangles whose corners have changed, ascending.</summary>
        public uint[] Changed = new uint[0];

        /// <summary>Vertices from this one on are new; the others keep their numbers and places.</summary>
        public int FirstVertex;

        /// <summary>Every vertex and triangle is new: the first surface, and after another body was put back.</summary>
        public bool IsNew;
    }

    // A body that changes. A cut scene has more nodes: NodeCount and RegionCount grow, and with them every output.
    public sealed unsafe partial class Scene
    {
        /// <summary>Cuts along the way of a blade's edge of <paramref name="edgePoints"/> points through the tissue as it is
        /// now; <paramref name="poses"/> is <c>[poses,edgePoints,3]</c>, mm. Calls with the same
        /// <paramref name="stroke"/> are one blade that goes on. Throws <c>UPT_ERR_UNSUPPORTED</c> where the scene does not
        /// correct, and where a support moves.</summary>
        public upt_cut Cut(int stroke, float[] poses, int edgePoints)
        {
            return CutWith(default(Blade), stroke, poses, edgePoints);
        }

        /// <summary>The same by a blade that feels the tissue (<c>force</c>), and is felt. It may refuse to cut: nothing has changed then, and
        /// <c>area_mm2</c> is 0.</summary>
        public upt_cut CutWith(Blade blade, int stroke, float[] poses, int edgePoints)
        {
            if (poses == null) throw new ArgumentNullException("poses");
            if (edgePoints < 2 || poses.Length % (3 * edgePoints) != 0)
                throw new ArgumentException("poses hold " + poses.Length + " floats, which are no poses of " + edgePoints +
                                            " points", "poses");
            upt_blade own = default(upt_blade);
            own.struct_size = (uint)sizeof(upt_blade);
            own.fracture_energy = blade.FractureEnergy;
            own.threshold = blade.Threshold;
            own.pushed = blade.Pushed;
            own.ahead[0] = blade.Ahead.X;
            own.ahead[1] = blade.Ahead.Y;
            own.ahead[2] = blade.Ahead.Z;
            upt_cut made = Blank();
            IntPtr scene = Enter();
            try
            {
                ulong count = (ulong)(poses.Length / (3 * edgePoints));
                fixed (float* p = poses)
                    Status.Check(Native.upt_scene_cut_with(scene, &own, unchecked((uint)stroke), p, count, (ulong)edgePoints,
                                                           &made));
            }
            finally { Leave(); }
            Fit();
            return made;
        }

        /// <summary>Removes what lies inside of an instrument, the deepest first, up to <paramref name="mostMm3"/>: an
        /// aspirator with a rate takes that times the step.</summary>
        public upt_cut Remove(upt_instrument instrument, float mostMm3)
        {
            instrument.struct_size = (uint)sizeof(upt_instrument);
            upt_cut made = Blank();
            IntPtr scene = Enter();
            try { Status.Check(Native.upt_scene_remove(scene, &instrument, mostMm3, &made)); }
            finally { Leave(); }
            Fit();
            return made;
        }

        /// <summary>
        /// Parts tissue that is longer than <paramref name="stretch"/> times its length at rest, across that direction as a blade would: call it
        /// before each step, and a tear grows from step to step.
        /// </summary>
        public upt_cut Tear(uint stroke, float stretch, uint most)
        {
            upt_cut made = Blank();
            IntPtr scene = Enter();
            try { Status.Check(Native.upt_scene_tear(scene, stroke, stretch, most, &made)); }
            finally { Leave(); }
            Fit();
            return made;
        }

        /// <summary>Multiplies the stiffness of elements of the model's mesh: coagulation, oedema, softening.</summary>
        public upt_cut ScaleStiffness(uint[] elements, float factor)
        {
            if (elements == null) throw new ArgumentNullException("elements");
            upt_cut made = Blank();
            IntPtr scene = Enter();
            try
            {
                fixed (uint* e = elements)
                    Status.Check(Native.upt_scene_scale_stiffness(scene, e, (ulong)elements.Length, factor, &made));
            }
            finally { Leave(); }
            Fit();
            return made;
        }

        /// <summary>Takes the pieces that nothing holds out of the body.</summary>
        public upt_cut DropFragments()
        {
            upt_cut made = Blank();
            IntPtr scene = Enter();
            try { Status.Check(Native.upt_scene_drop_fragments(scene, &made)); }
            finally { Leave(); }
            Fit();
            return made;
        }

        /// <summary>Brings the closed surface of the body up to date; true where something has changed since the last call.
        /// Arrays whose length has changed are replaced by new ones.</summary>
        public bool UpdateSurface(CutSurface surface)
        {
            if (surface == null) throw new ArgumentNullException("surface");
            upt_surface now = default(upt_surface);
            now.struct_size = (uint)sizeof(upt_surface);
            IntPtr scene = Enter();
            try
            {
                Status.Check(Native.upt_scene_update_surface(scene, &now));
                Array.Resize(ref surface.Rest, checked((int)(3 * now.vertex_count)));
                Array.Resize(ref surface.Triangles, checked((int)(3 * now.triangle_count)));
                Array.Resize(ref surface.Inside, checked((int)now.triangle_count));
                Array.Resize(ref surface.Changed, checked((int)now.changed_count));
                fixed (float* r = surface.Rest)
                fixed (uint* t = surface.Triangles)
                fixed (byte* i = surface.Inside)
                fixed (uint* c = surface.Changed)
                {
                    Status.Check(Native.upt_scene_read_surface(scene, r, now.vertex_count, t, i, now.triangle_count, c,
                                                          now.changed_count));
                }
            }
            finally { Leave(); }
            surface.FirstVertex = checked((int)now.first_vertex);
            surface.IsNew = now.is_new != 0;
            return now.changed_count > 0 || now.first_vertex < now.vertex_count;
        }

        /// <summary>Where the vertices of the surface are in the last state, <c>[v,3]</c>, mm. Throws <c>UPT_ERR_STATE</c>
        /// where the body has changed since <see cref="UpdateSurface"/>.</summary>
        public void SurfacePositions(float[] output)
        {
            IntPtr scene = Enter();
            try
            {
                fixed (float* o = output)
                    Status.Check(Native.upt_scene_read_surface_positions(scene, o, Length(output)));
            }
            finally { Leave(); }
        }

        private static upt_cut Blank()
        {
            upt_cut made = default(upt_cut);
            made.struct_size = (uint)sizeof(upt_cut);
            return made;
        }

        // The scene may have other nodes now; a region stays the nodes that it was.
        private void Fit()
        {
            ulong count = 0;
            IntPtr scene = Enter();
            try { Status.Check(Native.upt_scene_read_node_count(scene, &count)); }
            finally { Leave(); }
            int nodes = checked((int)count);
            if (nodes == NodeCount) return;
            NodeCount = nodes;
            if (!hasRegion) RegionCount = nodes;
        }
    }
}
