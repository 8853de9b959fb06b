using System;
using System.Runtime.InteropServices;

namespace Upt.Interop
{
    /// <summary>The library's structs of an input's pressures and support groups, whose arrays are held in place while a call
    /// reads them.</summary>
    internal unsafe struct PinnedLists : IDisposable
    {
        /// <summary>Most pressures that a step takes.</summary>
        internal const int MostPressures = 32;

        /// <summary>Most support groups.</summary>
        internal const int MostGroups = 64;

        private fixed long handles[MostPressures + MostGroups];
        private int count;

        /// <summary>Writes to <paramref name="pressures"/> and <paramref name="groups"/>, which have room for all.</summary>
        internal PinnedLists(StepInput input, upt_pressure* pressures, upt_support* groups)
        {
            count = 0;
            for (int i = 0; input.Pressures != null && i < input.Pressures.Length; i++)
            {
                Pressure own = input.Pressures[i];
                pressures[i] = default(upt_pressure);
                pressures[i].struct_size = (uint)sizeof(upt_pressure);
                pressures[i].pascal = own.Pascal;
                pressures[i].nodes = (uint*)Hold(own.Nodes);
                pressures[i].node_count = (ulong)(own.Nodes == null ? 0 : own.Nodes.Length);
            }
            for (int i = 0; input.SupportGroups != null && i < input.SupportGroups.Length; i++)
            {
                SupportGroup own = input.SupportGroups[i];
                groups[i] = default(upt_support);
                groups[i].struct_size = (uint)sizeof(upt_support);
                groups[i].group = checked((uint)own.Group);
                groups[i].position[0] = own.Position.X;
                groups[i].position[1] = own.Position.Y;
                groups[i].position[2] = own.Position.Z;
                groups[i].rotation[0] = own.Rotation.X;
                groups[i].rotation[1] = own.Rotation.Y;
                groups[i].rotation[2] = own.Rotation.Z;
                groups[i].rotation[3] = own.Rotation.W;
                groups[i].let_go = (byte)(own.LetGo ? 1 : 0);
                groups[i].displacements = (float*)Hold(own.Displacements);
                groups[i].displacement_count = (ulong)(own.Displacements == null ? 0 : own.Displacements.Length);
            }
        }

        public void Dispose()
        {
            fixed (long* held = handles)
            {
                while (count > 0) GCHandle.FromIntPtr((IntPtr)held[--count]).Free();
            }
        }

        private IntPtr Hold(Array array)
        {
            if (array == null) return IntPtr.Zero;
            GCHandle handle = GCHandle.Alloc(array, GCHandleType.Pinned);
            fixed (long* held = handles) held[count++] = (long)GCHandle.ToIntPtr(handle);
            return handle.AddrOfPinnedObject();
        }
    }
}
