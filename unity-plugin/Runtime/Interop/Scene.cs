using System;

namespace Upt.Interop
{
    /// <summary>
    /// One soft tissue that is stepped: <c>u' = M(u, c)</c>. Used by one thread at a time (another gets
    /// <c>UPT_ERR_BUSY</c>). No call allocates managed memory unless it says so. Lengths are in
    /// floats; vectors are <c>[n,3]</c>, row-major, mm.
    /// </summary>
    public sealed unsafe partial class Scene : IDisposable
    {
        private readonly SceneHandle handle;
        private bool hasRegion;

        /// <summary>Number of mesh nodes, <c>K</c>, and of the copies that cuts have made.</summary>
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

        /// <summary>Back to rest, with the intact body.</summary>
        public void Reset()
        {
            IntPtr scene = Enter();
            try { Status.Check(Native.upt_scene_reset(scene)); }
            finally { Leave(); }
            Fit();
        }

        /// <summary>
        /// One step, with contact of instruments solved. <paramref name="output"/> (<c>[RegionCount,3]</c>) null: keep it
        /// inside. Throws <c>UPT_ERR_UNSUPPORTED</c> for instruments and a bundle without a linear response.
        /// </summary>
        public void Step(StepInput input, float[] output)
        {
            input.Require(NodeCount);
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
                fixed (float* o = output)
                {
                    upt_input raw = input.Raw(i, n, v, c, u, f, p, t, g, q);
                    Status.Check(Native.upt_scene_step(scene, &raw, o, Length(output)));
                }
            }
            finally { Leave(); }
        }

        /// <summary>The paper's step, of dense fields: <paramref name="displacement"/> (<c>[K,3]</c>) null is the scene's own
        /// state, <paramref name="collision"/> (<c>[K,3]</c>) null no contact.</summary>
        public void StepField(float[] displacement, float[] collision, float[] output)
        {
            StepInput input = StepInput.OfField(collision);
            input.Displacement = displacement;
            Step(input, output);
        }

        /// <summary>Hands a step to the scene's worker and returns at once; the input is copied. Throws when one is in
        /// flight and the scene was not made with <c>latest_wins</c>.</summary>
        public void Submit(StepInput input)
        {
            input.Require(NodeCount);
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
                    Status.Check(Native.upt_scene_submit(scene, &raw));
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
                upt_status status = Native.upt_scene_poll(scene);
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
                upt_status status = Native.upt_scene_wait(scene, timeoutMilliseconds);
                Status.Check(status);
                return status != Native.UPT_PENDING;
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
            hasRegion = nodes != null && nodes.Length > 0;
            RegionCount = hasRegion ? nodes.Length : NodeCount;
        }

        /// <summary>What the last step and its stages took, ms.</summary>
        public upt_scene_timing Timing()
        {
            upt_scene_timing timing = default(upt_scene_timing);
            timing.struct_size = (uint)sizeof(upt_scene_timing);
            IntPtr scene = Enter();
            try { Status.Check(Native.upt_scene_read_timing(scene, &timing)); }
            finally { Leave(); }
            return timing;
        }

        /// <summary>Flags and sleep state of the last step.</summary>
        public upt_scene_stats Stats()
        {
            upt_scene_stats stats = default(upt_scene_stats);
            stats.struct_size = (uint)sizeof(upt_scene_stats);
            IntPtr scene = Enter();
            try { Status.Check(Native.upt_scene_read_stats(scene, &stats)); }
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
            Fit();
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
    }
}
