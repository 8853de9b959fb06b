using System;

namespace Upt.Interop
{
    // What rigid instruments feel.
    public sealed unsafe partial class Scene
    {
        /// <summary>What the tissue did to each instrument of the last step; <paramref name="count"/> is their
        /// number.</summary>
        public void Readings(upt_instrument_reading[] output, int count)
        {
            if (count < 0 || count > (output == null ? 0 : output.Length)) throw new ArgumentOutOfRangeException("count");
            for (int i = 0; i < count; i++) output[i].struct_size = (uint)sizeof(upt_instrument_reading);
            IntPtr scene = Enter();
            try
            {
                fixed (upt_instrument_reading* o = output)
                    Status.Check(Native.upt_scene_read_instruments(scene, o, (ulong)count));
            }
            finally { Leave(); }
        }

        /// <summary>The points of the surface that pushed or held instruments at the end of the last step; returns their
        /// number. An array that is too short is replaced by a longer one.</summary>
        public int InstrumentContacts(ref upt_instrument_contact[] output)
        {
            IntPtr scene = Enter();
            try
            {
                ulong needed = 0;
                Status.Check(Native.upt_scene_read_instrument_contacts(scene, null, 0, &needed));
                if (output == null || (ulong)output.Length < needed) output = new upt_instrument_contact[2 * needed];
                if (needed == 0) return 0;
                fixed (upt_instrument_contact* o = output)
                    Status.Check(Native.upt_scene_read_instrument_contacts(scene, o, (ulong)output.Length, &needed));
                return checked((int)needed);
            }
            finally { Leave(); }
        }

        /// <summary>Contacts of instrument poses with the tissue as it is now; returns their number. The
        /// arrays must hold it (at most one entry a surface node).</summary>
        public int ContactsFrom(upt_instrument[] instruments, int instrumentCount, uint[] nodes, float[] vectors)
        {
            if (instruments == null) throw new ArgumentNullException("instruments");
            if (nodes == null) throw new ArgumentNullException("nodes");
            if (vectors == null) throw new ArgumentNullException("vectors");
            if (instrumentCount < 0 || instrumentCount > instruments.Length)
                throw new ArgumentOutOfRangeException("instrumentCount");
            IntPtr scene = Enter();
            try
            {
                ulong found = 0;
                ulong capacity = (ulong)Math.Min(nodes.Length, vectors.Length / 3);
                fixed (upt_instrument* i = instruments)
                fixed (uint* n = nodes)
                fixed (float* v = vectors)
                {
                    Status.Check(Native.upt_scene_contacts_from_instruments(scene, i, (ulong)instrumentCount, n, v,
                                                                            capacity, &found));
                }
                return checked((int)found);
            }
            finally { Leave(); }
        }

        /// <summary>Makes a tool felt: <paramref name="tool"/> at place <paramref name="instrument"/> of the steps'
        /// instruments, where it is now. No step may be in flight. Throws <c>UPT_ERR_UNSUPPORTED</c> where the scene does not
        /// correct.</summary>
        public Haptics MakeHaptics(int instrument, upt_instrument tool, upt_haptics_options options)
        {
            options.struct_size = (uint)sizeof(upt_haptics_options);
            options.instrument = checked((uint)instrument);
            options.tool = &tool;
            IntPtr scene = Enter();
            try
            {
                IntPtr created = IntPtr.Zero;
                Status.Check(Native.upt_haptics_create(scene, &options, &created));
                return new Haptics(created);
            }
            finally { Leave(); }
        }
    }
}
