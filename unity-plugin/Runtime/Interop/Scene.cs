using System;

namespace Upt.Interop
{
    /// <summary>
    /// One soft tissue that is stepped: <c>u' = M(u, c)</c>. Used by one thread at a time (another gets
    /// <c>UPT_ERR_BUSY</c>). No call allocates managed memory unless it says so. Lengths are in
    /// floats; vectors are <c>[n,3]</c>, row-major, mm.
    /// </summary>
    public sealed unsafe class Scene : IDisposable
    {
        private readonly SceneHandle handle;

        /// <summary>Number of mesh nodes, <c>K</c>.</summary>
        public int NodeCount { get; private set; }

        /// <summary>Number of nodes that steps write and reads return: <c>K</c>, or the region's.</summary>
        public int RegionCount { get; private set; }

        /// <summary>Number of attached points.</summary>
        public int PointCount { get; private set; }

        /// <summary>A scene of <paramref name="model"/> on the bundle's mesh, at rest.</summary>
        public Scene(Model model, upt_scene_options options)
        {
            if (model == null) throw new ArgumentNullException("model");
            options.struct_size = (uint)sizeof(upt_scene_options);
            bool added = false;
            model.Handle.DangerousAddRef(ref added);
            try
            {
                IntPtr created = IntPtr.Zero;
                Status.Check(Native.upt_scene_create(model.Handle.DangerousGetHandle(), &options, &created));
                handle = new SceneHandle(created, model.Handle);
            }
            finally
            {
                model.Handle.DangerousRelease();
            }
            NodeCount = model.NodeCount;
            RegionCount = model.NodeCount;
        }

        /// <summary>A scene with the default options.</summary>
        public Scene(Model model) : this(model, default(upt_scene_options))
        {
        }

        /// <summary>True after <see cref="Dispose"/>.</summary>
        public bool IsDisposed
        {
            get { return handle.IsClosed; }
        }

        /// <summary>Back to rest.</summary>
        public void Reset()
        {
            IntPtr scene = Enter();
            try { Status.Check(Native.upt_scene_reset(scene)); }
            finally { Leave(); }
        }

        /// <summary>
        /// One step with dense fields. <paramref name="displacement"/> (<c>[K,3]</c>) null: the scene's
        /// own state; <paramref name="collision"/> (<c>[K,3]</c>) null: no contact;
        /// <paramref name="output"/> (<c>[RegionCount,3]</c>) null: keep it inside.
        /// </summary>
        public void Step(float[] displacement, float[] collision, float[] output)
        {
            RequireField(displacement, "displacement");
            RequireField(collision, "collision");
            IntPtr scene = Enter();
            try
            {
                fixed (float* u = displacement)
                fixed (float* c = collision)
                fixed (float* o = output)
                {
                    Status.Check(Native.upt_scene_step(scene, u, c, o, Length(output)));
                }
            }
            finally { Leave(); }
        }

        /// <summary>One step from the scene's own state with the first <paramref name="count"/> entries of
        /// the contact list.</summary>
        public void StepContacts(uint[] nodes, float[] vectors, int count, float[] output)
        {
            RequireContacts(nodes, vectors, count);
            IntPtr scene = Enter();
            try
            {
                fixed (uint* n = nodes)
                fixed (float* v = vectors)
                fixed (float* o = output)
                {
                    Status.Check(Native.upt_scene_step_contacts(scene, n, v, (ulong)count, o, Length(output)));
                }
            }
            finally { Leave(); }
        }

        /// <summary>Hands a step to the scene's worker and returns at once. Throws when one is in flight
        /// and the scene was not made with <c>latest_wins</c>.</summary>
        public void Submit(uint[] nodes, float[] vectors, int count)
        {
            RequireContacts(nodes, vectors, count);
            IntPtr scene = Enter();
            try
            {
                fixed (uint* n = nodes)
                fixed (float* v = vectors)
                {
                    Status.Check(Native.upt_scene_submit(scene, n, v, (ulong)count));
                }
            }
            finally { Leave(); }
        }

        /// <summary>True when the submitted step has finished; throws its error.</summary>
        public bool Poll()
        {
            IntPtr scene = Enter();
            try
            {
                int status = Native.upt_scene_poll(scene);
                Status.Check(status);
                return status != Native.UPT_PENDING;
            }
            finally { Leave(); }
        }

        /// <summary>Waits for the submitted step; false after <paramref name="timeoutMilliseconds"/>.</summary>
        public bool Wait(uint timeoutMilliseconds)
        {
            IntPtr scene = Enter();
            try
            {
                int status = Native.upt_scene_wait(scene, timeoutMilliseconds);
                Status.Check(status);
                return status != Native.UPT_PENDING;
            }
            finally { Leave(); }
        }

        /// <summary>The last published displacement, in the region's order.</summary>
        public void Read(float[] output)
        {
            IntPtr scene = Enter();
            try
            {
                fixed (float* o = output)
                    Status.Check(Native.upt_scene_read(scene, o, Length(output)));
            }
            finally { Leave(); }
        }

        /// <summary>Displacement between the state before (<paramref name="alpha"/> = 0) and the last state
        /// (1).</summary>
        public void Sample(double alpha, float[] output)
        {
            IntPtr scene = Enter();
            try
            {
                fixed (float* o = output)
                    Status.Check(Native.upt_scene_sample(scene, alpha, o, Length(output)));
            }
            finally { Leave(); }
        }

        /// <summary>Only <paramref name="nodes"/> are decoded from now on; null: all nodes.</summary>
        public void SetRegion(uint[] nodes)
        {
            IntPtr scene = Enter();
            try
            {
                fixed (uint* n = nodes)
                    Status.Check(Native.upt_scene_set_region(scene, n, nodes == null ? 0 : (ulong)nodes.Length));
            }
            finally { Leave(); }
            RegionCount = nodes == null || nodes.Length == 0 ? NodeCount : nodes.Length;
        }

        /// <summary>Displacement of any nodes, decoded now from the latest state.</summary>
        public void Decode(uint[] nodes, float[] output)
        {
            if (nodes == null) throw new ArgumentNullException("nodes");
            IntPtr scene = Enter();
            try
            {
                fixed (uint* n = nodes)
                fixed (float* o = output)
                    Status.Check(Native.upt_scene_decode(scene, n, (ulong)nodes.Length, o, Length(output)));
            }
            finally { Leave(); }
        }

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

        /// <summary>One step from the scene's own state that the first <paramref name="count"/> instruments drive: their
        /// contact is solved. Throws <c>UPT_ERR_UNSUPPORTED</c> for a bundle without a linear response.</summary>
        public void StepInstruments(upt_instrument[] instruments, int count, float[] output)
        {
            RequireInstruments(instruments, count);
            IntPtr scene = Enter();
            try
            {
                fixed (upt_instrument* i = instruments)
                fixed (float* o = output)
                    Status.Check(Native.upt_scene_step_instruments(scene, i, (ulong)count, o, Length(output)));
            }
            finally { Leave(); }
        }

        /// <summary>Hands such a step to the scene's worker and returns at once; the instruments are copied.</summary>
        public void SubmitInstruments(upt_instrument[] instruments, int count)
        {
            RequireInstruments(instruments, count);
            IntPtr scene = Enter();
            try
            {
                fixed (upt_instrument* i = instruments)
                    Status.Check(Native.upt_scene_submit_instruments(scene, i, (ulong)count));
            }
            finally { Leave(); }
        }

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
                    Status.Check(Native.upt_scene_instrument_readings(scene, o, (ulong)count));
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
                Status.Check(Native.upt_scene_instrument_contacts(scene, null, 0, &needed));
                if (output == null || (ulong)output.Length < needed) output = new upt_instrument_contact[2 * needed];
                if (needed == 0) return 0;
                fixed (upt_instrument_contact* o = output)
                    Status.Check(Native.upt_scene_instrument_contacts(scene, o, (ulong)output.Length, &needed));
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

        /// <summary>Times per stage, flags, sleep state of the last step.</summary>
        public upt_scene_stats Stats()
        {
            upt_scene_stats stats = default(upt_scene_stats);
            stats.struct_size = (uint)sizeof(upt_scene_stats);
            IntPtr scene = Enter();
            try { Status.Check(Native.upt_scene_get_stats(scene, &stats)); }
            finally { Leave(); }
            return stats;
        }

        /// <summary>A snapshot that <see cref="Restore"/> resumes to the bit. Allocates the array.</summary>
        public byte[] Save()
        {
            IntPtr scene = Enter();
            try
            {
                ulong needed = 0;
                Status.Check(Native.upt_scene_save(scene, null, 0, &needed));
                byte[] bytes = new byte[needed];
                fixed (byte* b = bytes)
                    Status.Check(Native.upt_scene_save(scene, b, needed, &needed));
                return bytes;
            }
            finally { Leave(); }
        }

        /// <summary>Resumes from a snapshot of the same model.</summary>
        public void Restore(byte[] snapshot)
        {
            if (snapshot == null) throw new ArgumentNullException("snapshot");
            IntPtr scene = Enter();
            try
            {
                fixed (byte* b = snapshot)
                    Status.Check(Native.upt_scene_restore(scene, b, (ulong)snapshot.Length));
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

        /// <summary>Ends the scene. Waits for a step in flight. May be called again.</summary>
        public void Dispose()
        {
            handle.Dispose();
        }

        private IntPtr Enter()
        {
            bool added = false;
            handle.DangerousAddRef(ref added);
            return handle.DangerousGetHandle();
        }

        private void Leave()
        {
            handle.DangerousRelease();
        }

        private static ulong Length(float[] array)
        {
            return array == null ? 0 : (ulong)array.Length;
        }

        private void RequireField(float[] field, string parameter)
        {
            if (field != null && field.Length != 3 * NodeCount)
                throw new ArgumentException(
                    parameter + " holds " + field.Length + " floats, the mesh has " + NodeCount + " nodes (" +
                        3 * NodeCount + " floats)",
                    parameter);
        }

        private static void RequireInstruments(upt_instrument[] instruments, int count)
        {
            int room = instruments == null ? 0 : instruments.Length;
            if (count < 0 || count > room)
                throw new ArgumentOutOfRangeException(
                    "count", "count is " + count + ", the array holds " + room + " instruments");
        }

        private static void RequireContacts(uint[] nodes, float[] vectors, int count)
        {
            int room = Math.Min(nodes == null ? 0 : nodes.Length, vectors == null ? 0 : vectors.Length / 3);
            if (count < 0 || count > room)
                throw new ArgumentOutOfRangeException(
                    "count", "count is " + count + ", the contact arrays hold " + room + " entries");
        }
    }
}
