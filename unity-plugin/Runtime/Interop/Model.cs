using System;

namespace Upt.Interop
{
    /// <summary>An opened bundle: immutable, shared by scenes, safe from any thread.</summary>
    public sealed unsafe class Model : IDisposable
    {
        private readonly ModelHandle handle;

        /// <summary>Counts, time step, provider and memory of the model.</summary>
        public upt_model_info Info { get; private set; }

        /// <summary>Opens the bundle folder <paramref name="path"/> with the CPU provider and
        /// <paramref name="threads"/> threads (0: the library's default). Throws
        /// <see cref="UptException"/>, whose message names the file and field that is wrong.</summary>
        public Model(string path, uint threads) : this(path, threads, false)
        {
        }

        /// <summary>The same; with <paramref name="portable"/> steps have the same bits on every
        /// processor, for replays and lockstep (reduced bundles without a network).</summary>
        public Model(string path, uint threads, bool portable)
        {
            Library.Verify();
            upt_model_options options = default(upt_model_options);
            options.struct_size = (uint)sizeof(upt_model_options);
            options.threads = threads;
            options.portable = portable ? (byte)1 : (byte)0;
            IntPtr pointer = IntPtr.Zero;
            fixed (byte* bytes = Utf8.Encode(path, "path"))
            {
                Status.Check(Native.upt_model_create(bytes, &options, &pointer));
            }
            handle = new ModelHandle(pointer);
            upt_model_info info = default(upt_model_info);
            info.struct_size = (uint)sizeof(upt_model_info);
            upt_status status = Native.upt_model_read_info(pointer, &info);
            if (status < 0) handle.Dispose();
            Status.Check(status);
            Info = info;
        }

        internal ModelHandle Handle
        {
            get { return handle; }
        }

        /// <summary>Number of mesh nodes, <c>K</c>.</summary>
        public int NodeCount
        {
            get { return checked((int)Info.node_count); }
        }

        /// <summary>Rest positions, <c>3 K</c> floats, mm.</summary>
        public float[] Positions()
        {
            float[] positions = new float[3 * NodeCount];
            bool added = false;
            handle.DangerousAddRef(ref added);
            try
            {
                fixed (float* pointer = positions)
                {
                    Status.Check(Native.upt_model_read_positions(handle.DangerousGetHandle(), pointer,
                                                            (ulong)positions.Length));
                }
            }
            finally
            {
                handle.DangerousRelease();
            }
            return positions;
        }

        /// <summary>An index set (<c>Native.UPT_SET_*</c>) of the mesh: nodes, or 3 per face, or 4 per
        /// tetrahedron.</summary>
        public uint[] Indices(upt_index_set set)
        {
            bool added = false;
            handle.DangerousAddRef(ref added);
            try
            {
                ulong needed = 0;
                Status.Check(Native.upt_model_read_indices(handle.DangerousGetHandle(), set, null, 0, &needed));
                uint[] indices = new uint[needed];
                if (needed == 0) return indices;
                fixed (uint* pointer = indices)
                {
                    Status.Check(Native.upt_model_read_indices(handle.DangerousGetHandle(), set, pointer, needed,
                                                          &needed));
                }
                return indices;
            }
            finally
            {
                handle.DangerousRelease();
            }
        }

        /// <summary>Forces of zero at places of the mesh at rest, <c>[n,3]</c>, mm: each in the tetrahedron that holds it. Find
        /// them once, and set them in each step (<see cref="StepInput.PointForces"/>).</summary>
        public upt_point_force[] Locate(float[] places)
        {
            if (places == null || places.Length % 3 != 0)
                throw new ArgumentException("places must hold three numbers a place", "places");
            int count = places.Length / 3;
            upt_point_force[] forces = new upt_point_force[count];
            uint[] nodes = new uint[4 * count];
            float[] weights = new float[4 * count];
            bool added = false;
            handle.DangerousAddRef(ref added);
            try
            {
                fixed (float* p = places)
                fixed (uint* n = nodes)
                fixed (float* w = weights)
                    Status.Check(Native.upt_model_locate_points(handle.DangerousGetHandle(), p, (ulong)count, n, w));
            }
            finally
            {
                handle.DangerousRelease();
            }
            fixed (upt_point_force* found = forces)
            {
                for (int i = 0; i < count; i++)
                {
                    found[i].struct_size = (uint)sizeof(upt_point_force);
                    for (int k = 0; k < 4; k++)
                    {
                        found[i].nodes[k] = nodes[4 * i + k];
                        found[i].weights[k] = weights[4 * i + k];
                    }
                }
            }
            return forces;
        }

        /// <summary>Node indices of a support group, ascending: what <see cref="StepInput.SupportGroups"/> moves. Groups count
        /// from 0; their names are in <see cref="Describe"/>, under <c>supports</c>.</summary>
        public uint[] SupportNodes(int group)
        {
            return Named(checked((uint)group), false);
        }

        /// <summary>Node indices of a region of the surface, ascending: what <see cref="Pressure.Nodes"/> takes. Regions count
        /// from 0; their names are in <see cref="Describe"/>, under <c>regions</c>.</summary>
        public uint[] RegionNodes(int region)
        {
            return Named(checked((uint)region), true);
        }

        uint[] Named(uint at, bool region)
        {
            bool added = false;
            handle.DangerousAddRef(ref added);
            try
            {
                IntPtr model = handle.DangerousGetHandle();
                ulong needed = 0;
                Status.Check(region ? Native.upt_model_read_region(model, at, null, 0, null, 0, &needed)
                                    : Native.upt_model_read_support(model, at, null, 0, null, 0, &needed));
                uint[] nodes = new uint[needed];
                fixed (uint* to = nodes)
                    Status.Check(region ? Native.upt_model_read_region(model, at, null, 0, to, needed, &needed)
                                        : Native.upt_model_read_support(model, at, null, 0, to, needed, &needed));
                return nodes;
            }
            finally
            {
                handle.DangerousRelease();
            }
        }

        /// <summary>JSON: the bundle's name and hash, the provider of each stage and why others were not
        /// taken.</summary>
        public string Describe()
        {
            bool added = false;
            handle.DangerousAddRef(ref added);
            try
            {
                ulong needed = 0;
                Status.Check(Native.upt_model_describe(handle.DangerousGetHandle(), null, 0, &needed));
                byte[] text = new byte[needed + 1];
                fixed (byte* pointer = text)
                {
                    Status.Check(Native.upt_model_describe(handle.DangerousGetHandle(), pointer,
                                                           (ulong)text.Length, &needed));
                    return Utf8.Decode(pointer);
                }
            }
            finally
            {
                handle.DangerousRelease();
            }
        }

        /// <summary>Closes the model; scenes made from it go on until they are disposed.</summary>
        public void Dispose()
        {
            handle.Dispose();
        }
    }
}
