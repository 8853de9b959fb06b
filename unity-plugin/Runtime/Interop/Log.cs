using System;
using System.Runtime.InteropServices;

namespace Upt.Interop
{
    /// <summary>Marks a static method that native code calls, for IL2CPP's ahead-of-time compiler,
    /// which recognises the attribute by its name.</summary>
    [AttributeUsage(AttributeTargets.Method)]
    internal sealed class MonoPInvokeCallbackAttribute : Attribute
    {
        public MonoPInvokeCallbackAttribute(Type type)
        {
            Type = type;
        }

        public Type Type { get; private set; }
    }

    /// <summary>Messages of the native library. They come on threads that are inside of a call, at its end where the
    /// library's own threads made them.</summary>
    public static unsafe class Log
    {
        [UnmanagedFunctionPointer(CallingConvention.Cdecl)]
        private delegate void NativeLog(upt_log_level level, byte* message, IntPtr user);

        private static readonly NativeLog Callback = OnMessage;
        private static volatile Action<upt_log_level, string> receiver;

        static Log()
        {
            // Native code must not call into a scripting domain that is gone: the editor reloads it on each
            // compilation.
            AppDomain.CurrentDomain.DomainUnload += TurnOff;
            AppDomain.CurrentDomain.ProcessExit += TurnOff;
        }

        /// <summary>
        /// Sends messages of at least <paramref name="level"/> (<c>Native.UPT_LOG_*</c>) to
        /// <paramref name="target"/>. A null target turns the log off, and so do the unloading of the scripting domain and
        /// the end of the process.
        /// </summary>
        public static void Set(Action<upt_log_level, string> target, upt_log_level level)
        {
            Library.Verify();
            if (target == null)
            {
                Status.Check(Native.upt_set_log(IntPtr.Zero, IntPtr.Zero, Native.UPT_LOG_OFF));
                receiver = null;
                return;
            }
            receiver = target;
            Status.Check(Native.upt_set_log(Marshal.GetFunctionPointerForDelegate(Callback), IntPtr.Zero, level));
        }

        private static void TurnOff(object sender, EventArgs arguments)
        {
            if (receiver == null) return;
            receiver = null;
            Native.upt_set_log(IntPtr.Zero, IntPtr.Zero, Native.UPT_LOG_OFF);
        }

        [MonoPInvokeCallback(typeof(NativeLog))]
        private static void OnMessage(upt_log_level level, byte* message, IntPtr user)
        {
            Action<upt_log_level, string> target = receiver;
            if (target == null) return;
            try
            {
                target(level, Utf8.Decode(message));
            }
            catch (Exception)
            {
                // An exception must not unwind through native frames; the receiver's own fault stays with it.
            }
        }
    }
}
