using System;
using System.Runtime.InteropServices;

namespace Upt.Interop
{
#if UNITY_WEBGL && !UNITY_EDITOR
    /// <summary>Bundles of Unity's WebGL player, which has no files: they come from addresses, and the library from a folder
    /// beside them (Plugins/WebGL/libupt.jslib).</summary>
    public static unsafe class WebBundle
    {
        [DllImport("__Internal")]
        private static extern int upt_web_prepare(byte* folder, byte* address);

        [DllImport("__Internal")]
        private static extern float upt_web_progress(byte* address);

        [DllImport("__Internal")]
        private static extern byte* upt_web_error(byte* address);

        [DllImport("__Internal")]
        private static extern void upt_web_free(byte* text);

        /// <summary>Fetches the library from <paramref name="folder"/> and the bundle at <paramref name="address"/>, unless they are on
        /// their way; true once they are here. Throws <see cref="UptException"/> where they are not to be had.</summary>
        public static bool IsReady(string folder, string address)
        {
            fixed (byte* from = Utf8.Encode(folder, "folder"), bundle = Utf8.Encode(address, "address"))
            {
                int state = upt_web_prepare(from, bundle);
                if (state >= 0) return state == 1;
                byte* text = upt_web_error(bundle);
                string message = Utf8.Decode(text);
                upt_web_free(text);
                throw new UptException(Native.UPT_ERR_IO, message);
            }
        }

        /// <summary>The share of the bundle that has come, 0 to 1.</summary>
        public static float Progress(string address)
        {
            fixed (byte* bundle = Utf8.Encode(address, "address")) return upt_web_progress(bundle);
        }
    }
#endif
}
