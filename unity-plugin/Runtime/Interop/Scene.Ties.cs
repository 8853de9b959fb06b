using System;

namespace Upt.Interop
{
    public sealed unsafe partial class Scene
    {
        /// <summary>What each tie of the last step does, in the order of its ties.</summary>
        public upt_tie_reading[] TieReadings(int count)
        {
            upt_tie_reading[] output = new upt_tie_reading[count];
            for (int i = 0; i < count; i++) output[i].struct_size = (uint)sizeof(upt_tie_reading);
            IntPtr scene = Enter();
            try
            {
                fixed (upt_tie_reading* o = output)
                    Status.Check(Native.upt_scene_read_ties(scene, o, checked((ulong)count)));
            }
            finally { Leave(); }
            return output;
        }

        /// <summary>A tie of the point of the tissue nearest to a place (mm): without a stiffness, and tied to that
        /// place.</summary>
        public upt_tie TieAt(float x, float y, float z)
        {
            upt_tie tie = default(upt_tie);
            tie.struct_size = (uint)sizeof(upt_tie);
            tie.place[0] = x;
            tie.place[1] = y;
            tie.place[2] = z;
            IntPtr scene = Enter();
            try
            {
                Status.Check(Native.upt_scene_tie_points(scene, tie.place, 1, tie.nodes, tie.weights));
            }
            finally { Leave(); }
            return tie;
        }

        /// <summary>The ties of a bed: a tie at each free node of the domain within a region. The stiffness, damping and break
        /// force of <paramref name="bed"/> are shared among them by area. <paramref name="nodes"/> null: the region is the
        /// bed's ball.</summary>
        public upt_tie[] Bed(upt_bed bed, uint[] nodes = null)
        {
            bed.struct_size = (uint)sizeof(upt_bed);
            IntPtr scene = Enter();
            try
            {
                fixed (uint* n = nodes)
                {
                    bed.nodes = n;
                    bed.node_count = (ulong)(nodes == null ? 0 : nodes.Length);
                    ulong needed;
                    Status.Check(Native.upt_scene_bed(scene, &bed, null, 0, &needed));
                    upt_tie[] ties = new upt_tie[needed];
                    for (int i = 0; i < ties.Length; i++) ties[i].struct_size = (uint)sizeof(upt_tie);
                    fixed (upt_tie* t = ties) Status.Check(Native.upt_scene_bed(scene, &bed, t, needed, &needed));
                    return ties;
                }
            }
            finally { Leave(); }
        }
    }
}
