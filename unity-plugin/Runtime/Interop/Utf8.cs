using System;
using System.Text;

namespace Upt.Interop
{
    /// <summary>UTF-8 strings across the C ABI. Marshalling is by hand, because the default
    /// marshaller of Mono and IL2CPP uses the platform's ANSI code page for <c>char*</c>.</summary>
    internal static unsafe class Utf8
    {
        /// <summary>A zero-terminated UTF-8 copy. Throws when the text holds a NUL character.</summary>
        public static byte[] Encode(string text, string parameter)
        {
            if (text == null) throw new ArgumentNullException(parameter);
            if (text.IndexOf('\0') >= 0)
                throw new ArgumentException("the text holds a NUL character", parameter);
            byte[] bytes = new byte[Encoding.UTF8.GetByteCount(text) + 1];
            Encoding.UTF8.GetBytes(text, 0, text.Length, bytes, 0);
            return bytes;
        }

        /// <summary>The text at <paramref name="pointer"/> up to its NUL; empty for NULL.</summary>
        public static string Decode(byte* pointer)
        {
            if (pointer == null) return string.Empty;
            int length = 0;
            while (pointer[length] != 0) length++;
            return length == 0 ? string.Empty : Encoding.UTF8.GetString(pointer, length);
        }
    }
}
