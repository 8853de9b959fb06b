using System;

namespace Upt.Interop
{
    /// <summary>
    /// A tool that a hand feels: the force on it at a pose, asked up to a thousand times a second from one thread of its own,
    /// whatever the scene does. Metres, newtons, newton metres, in the mesh's frame. No call allocates managed
    /// memory. Made by <see cref="Scene.MakeHaptics"/>.
    /// </summary>
    public sealed unsafe class Haptics : IDisposable
    {
        private readonly HapticsHandle handle;

        internal Haptics(IntPtr created)
        {
            handle = new HapticsHandle(created);
        }

        /// <summary>The force at <paramref name="pose"/>, whose time is never before that of the last call; zero where the
        /// call throws.</summary>
        public void Render(upt_haptic_pose pose, out upt_haptic_force force)
        {
            pose.struct_size = (uint)sizeof(upt_haptic_pose);
            upt_haptic_force made = default(upt_haptic_force);
            made.struct_size = (uint)sizeof(upt_haptic_force);
            force = default(upt_haptic_force);
            bool added = false;
            handle.DangerousAddRef(ref added);
            try { Status.Check(Native.upt_haptics_render(handle.DangerousGetHandle(), &pose, &made)); }
            finally { handle.DangerousRelease(); }
            force = made;
        }

        /// <summary>Ends it; the scene goes on. May be called again.</summary>
        public void Dispose()
        {
            handle.Dispose();
        }
    }
}
