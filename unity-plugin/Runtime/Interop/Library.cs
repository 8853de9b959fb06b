using System;

namespace Upt.Interop
{
    /// <summary>The native library as a whole: presence, version, initialisation.</summary>
    public static unsafe class Library
    {
        private static bool verified;

        /// <summary>
        /// Loads libupt on the first call and compares its ABI with the one that these bindings were
        /// generated for. Throws <see cref="UptException"/> when it is missing, of another
        /// processor architecture, or of another ABI version.
        /// </summary>
        public static void Verify()
        {
            if (verified) return;
            uint found;
            try
            {
                found = Native.upt_abi_version();
            }
            catch (DllNotFoundException error)
            {
                throw new UptException(Native.UPT_ERR_RUNTIME,
                    "the native library 'upt' was not found, or is not for this processor: in Unity, fill Runtime/Plugins with " +
                    "`cargo xtask package --unity`; elsewhere put libupt.so (upt.dll, libupt.dylib) on the " +
                    "library path. " + error.Message);
            }
            catch (BadImageFormatException error)
            {
                throw new UptException(Native.UPT_ERR_RUNTIME,
                    "the native library 'upt' was built for another processor architecture than this " +
                    (IntPtr.Size * 8) + "-bit process. " + error.Message);
            }
            catch (EntryPointNotFoundException error)
            {
                throw new UptException(Native.UPT_ERR_VERSION,
                    "a library named 'upt' was found, but it is not libupt. " + error.Message);
            }
            string message = AbiMismatch(found, Native.UPT_ABI_VERSION);
            if (message != null) throw new UptException(Native.UPT_ERR_VERSION, message);
            verified = true;
        }

        /// <summary>The message for a library of ABI <paramref name="found"/> under bindings for
        /// <paramref name="expected"/>; null when they fit.</summary>
        public static string AbiMismatch(uint found, uint expected)
        {
            if (found == expected) return null;
            return "libupt has ABI version " + found + ", these bindings need " + expected +
                   ": install the library and the package of the same release";
        }

        /// <summary>Version of the native library, for instance "0.1.0".</summary>
        public static string Version
        {
            get
            {
                Verify();
                return Utf8.Decode(Native.upt_version());
            }
        }

        /// <summary>
        /// Optional: sets the path of ONNX Runtime (null: search next to libupt, then ORT_DYLIB_PATH, then
        /// the system) and the threads of the native pool (0: one). Throws when the library was
        /// already initialised with other options.
        /// </summary>
        public static void Initialise(string onnxRuntimePath, uint threads)
        {
            Verify();
            upt_init_options options = default(upt_init_options);
            options.struct_size = (uint)sizeof(upt_init_options);
            options.threads = threads;
            if (onnxRuntimePath == null)
            {
                Status.Check(Native.upt_init(&options));
                return;
            }
            fixed (byte* path = Utf8.Encode(onnxRuntimePath, "onnxRuntimePath"))
            {
                options.onnxruntime_path = path;
                Status.Check(Native.upt_init(&options));
            }
        }

        /// <summary>Releases what the library holds. Throws while models or scenes live.</summary>
        public static void Shutdown()
        {
            Verify();
            Status.Check(Native.upt_shutdown());
        }
    }
}
