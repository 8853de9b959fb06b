namespace Upt.Interop
{
    /// <summary>
    /// Rigid instruments, in millimetres of the mesh's frame: <c>Instruments.Sphere(6f).At(-63f, -14f, 8f)</c>. Each is at the
    /// origin, not turned, until its <c>position</c> and <c>rotation</c> are set.
    /// </summary>
    public static unsafe class Instruments
    {
        /// <summary>A ball of this radius, mm.</summary>
        public static upt_instrument Sphere(float radius)
        {
            return Of(Native.UPT_SHAPE_SPHERE, 0f, 0f, 0f, radius);
        }

        /// <summary>A capsule along its local y; <paramref name="halfLength"/> without the caps, mm.</summary>
        public static upt_instrument Capsule(float radius, float halfLength)
        {
            return Of(Native.UPT_SHAPE_CAPSULE, 0f, halfLength, 0f, radius);
        }

        /// <summary>A box of these half sizes, mm.</summary>
        public static upt_instrument Box(float x, float y, float z)
        {
            return Of(Native.UPT_SHAPE_BOX, x, y, z, 0f);
        }

        /// <summary>A box of these half sizes, rounded by <paramref name="radius"/>; mm.</summary>
        public static upt_instrument Spatula(float x, float y, float z, float radius)
        {
            return Of(Native.UPT_SHAPE_SPATULA, x, y, z, radius);
        }

        /// <summary>A tool of its own shape, which must live as long as steps use it.</summary>
        public static upt_instrument OfHull(Hull hull)
        {
            upt_instrument made = Of(Native.UPT_SHAPE_HULL, 0f, 0f, 0f, 0f);
            made.hull = hull.Pointer;
            return made;
        }

        /// <summary>The same with its centre there, mm.</summary>
        public static upt_instrument At(this upt_instrument instrument, float x, float y, float z)
        {
            instrument.position[0] = x;
            instrument.position[1] = y;
            instrument.position[2] = z;
            return instrument;
        }

        private static upt_instrument Of(upt_shape shape, float x, float y, float z, float radius)
        {
            upt_instrument made = default(upt_instrument);
            made.struct_size = (uint)sizeof(upt_instrument);
            made.shape = shape;
            made.half_extents[0] = x;
            made.half_extents[1] = y;
            made.half_extents[2] = z;
            made.radius = radius;
            return made;
        }
    }
}
