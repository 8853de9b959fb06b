using System;

namespace Upt.Interop
{
    /// <summary>A tool of its own shape, for <c>upt_instrument.hull</c>. Immutable. It must live while
    /// instruments that name it are handed to a scene; steps that were submitted with it go on.</summary>
    public sealed unsafe class Hull : IDisposable
    {
        private readonly HullHandle handle;

        /// <summary>The hull of <paramref name="points"/>: <c>[n,3]</c>, mm, in the tool's own frame; 4 to 100,000
        /// points with a volume. With <paramref name="faces"/>, <c>[m,3]</c>, the closed surface of these triangles, whose hollows
        /// stay.</summary>
        public Hull(float[] points, uint[] faces = null)
        {
            if (points == null) throw new ArgumentNullException("points");
            if (points.Length % 3 != 0)
                throw new ArgumentException("points hold " + points.Length + " floats, which is not a multiple of 3",
                                            "points");
            if (faces != null && faces.Length % 3 != 0)
                throw new ArgumentException("faces hold " + faces.Length + " points, which is not a multiple of 3", "faces");
            IntPtr created = IntPtr.Zero;
            ulong sides = faces == null ? 0 : (ulong)faces.Length / 3;
            fixed (float* p = points)
            fixed (uint* f = faces)
                Status.Check(Native.upt_hull_create(p, (ulong)points.Length / 3, f, sides, &created));
            handle = new HullHandle(created);
        }

        /// <summary>What <c>upt_instrument.hull</c> takes; zero after <see cref="Dispose"/>.</summary>
        public IntPtr Pointer
        {
            get { return handle.IsClosed ? IntPtr.Zero : handle.DangerousGetHandle(); }
        }

        /// <summary>Ends the hull. May be called again.</summary>
        public void Dispose()
        {
            handle.Dispose();
        }
    }
}
