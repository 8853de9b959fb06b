using System;

namespace Upt.Interop
{
    /// <summary>An error status of libupt with the library's own message, which says what to do.</summary>
    public sealed class UptException : Exception
    {
        /// <summary>The status, one of <c>Native.UPT_ERR_*</c>.</summary>
        public upt_status Status { get; private set; }

        /// <summary>As a failed call throws it.</summary>
        public UptException(upt_status status, string message) : base(message)
        {
            Status = status;
        }
    }

    internal static unsafe class Status
    {
        /// <summary>Throws when <paramref name="status"/> is an error (negative).</summary>
        public static void Check(upt_status status)
        {
            if (status < 0) Throw(status);
        }

        private static void Throw(upt_status status)
        {
            string name = Utf8.Decode(Native.upt_status_name(status));
            string text = Utf8.Decode(Native.upt_last_error());
            throw new UptException(status, text.Length == 0 ? name : name + ": " + text);
        }
    }
}
