using System;
using System.Runtime.InteropServices;

namespace Upt.Interop
{
    /// <summary>Owns a <c>upt_model*</c>.</summary>
    internal sealed class ModelHandle : SafeHandle
    {
        public ModelHandle(IntPtr pointer) : base(IntPtr.Zero, true)
        {
            SetHandle(pointer);
        }

        public override bool IsInvalid
        {
            get { return handle == IntPtr.Zero; }
        }

        protected override bool ReleaseHandle()
        {
            return Native.upt_model_destroy(handle) == Native.UPT_OK;
        }
    }

    /// <summary>Owns a <c>upt_scene*</c> and keeps its model's handle alive until it is released.</summary>
    internal sealed class SceneHandle : SafeHandle
    {
        private readonly ModelHandle model;

        public SceneHandle(IntPtr pointer, ModelHandle model) : base(IntPtr.Zero, true)
        {
            bool added = false;
            model.DangerousAddRef(ref added);
            this.model = model;
            SetHandle(pointer);
        }

        public override bool IsInvalid
        {
            get { return handle == IntPtr.Zero; }
        }

        protected override bool ReleaseHandle()
        {
            bool released = Native.upt_scene_destroy(handle) == Native.UPT_OK;
            model.DangerousRelease();
            return released;
        }
    }

    /// <summary>Owns a <c>upt_haptics*</c>.</summary>
    internal sealed class HapticsHandle : SafeHandle
    {
        public HapticsHandle(IntPtr pointer) : base(IntPtr.Zero, true)
        {
            SetHandle(pointer);
        }

        public override bool IsInvalid
        {
            get { return handle == IntPtr.Zero; }
        }

        protected override bool ReleaseHandle()
        {
            return Native.upt_haptics_destroy(handle) == Native.UPT_OK;
        }
    }

    /// <summary>Owns a <c>upt_hull*</c>.</summary>
    internal sealed class HullHandle : SafeHandle
    {
        public HullHandle(IntPtr pointer) : base(IntPtr.Zero, true)
        {
            SetHandle(pointer);
        }

        public override bool IsInvalid
        {
            get { return handle == IntPtr.Zero; }
        }

        protected override bool ReleaseHandle()
        {
            return Native.upt_hull_destroy(handle) == Native.UPT_OK;
        }
    }
}
