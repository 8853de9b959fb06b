using System;
using System.Runtime.InteropServices;

namespace Upt.Interop
{
    /// <summary>Pressure on a part of the surface at the end of a step. It follows the surface.</summary>
    public struct Pressure
    {
        /// <summary>From outside, Pa; negative for suction.</summary>
        public float Pascal;

        /// <summary>It acts on the boundary triangles with all corners among these nodes; null: on the domain.</summary>
        public uint[] Nodes;
    }

    /// <summary>The nodes of pressures, held in place while a call reads them.</summary>
    internal unsafe struct PinnedPressures : IDisposable
    {
        /// <summary>Most that a step takes.</summary>
        internal const int Most = 32;

        private fixed long handles[Most];
        private int count;

        /// <summary>Writes the library's structs to <paramref name="raw"/>, which has room for all.</summary>
        internal PinnedPressures(Pressure[] pressures, upt_pressure* raw)
        {
            count = 0;
            for (int i = 0; pressures != null && i < pressures.Length; i++)
            {
                uint[] nodes = pressures[i].Nodes;
                raw[i] = default(upt_pressure);
                raw[i].struct_size = (uint)sizeof(upt_pressure);
                raw[i].pascal = pressures[i].Pascal;
                if (nodes == null) continue;
                GCHandle handle = GCHandle.Alloc(nodes, GCHandleType.Pinned);
                fixed (long* held = handles) held[count++] = (long)GCHandle.ToIntPtr(handle);
                raw[i].nodes = (uint*)handle.AddrOfPinnedObject();
                raw[i].node_count = (ulong)nodes.Length;
            }
        }

        public void Dispose()
        {
            fixed (long* held = handles)
            {
                while (count > 0) GCHandle.FromIntPtr((IntPtr)held[--count]).Free();
            }
        }
    }
}
