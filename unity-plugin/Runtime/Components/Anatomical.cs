using UnityEngine;

namespace Upt
{
    /// <summary>
    /// Coordinates. A bundle is right-handed RAS in millimetres (x right, y anterior, z superior); Unity is
    /// left-handed with y up. The map (x, z, y) * scale exchanges two axes, so it also changes the
    /// handedness, and triangles keep facing outward when their winding is reversed.
    /// All functions are free of managed state: Burst can call them.
    /// </summary>
    public static unsafe class Anatomical
    {
        /// <summary>RAS millimetres to local Unity units.</summary>
        public static Vector3 ToUnity(float x, float y, float z, float unitsPerMillimetre)
        {
            return new Vector3(x * unitsPerMillimetre, z * unitsPerMillimetre, y * unitsPerMillimetre);
        }

        /// <summary>Local Unity units to RAS millimetres, written to <paramref name="ras"/>[0..3].</summary>
        public static void FromUnity(Vector3 local, float unitsPerMillimetre, float* ras)
        {
            ras[0] = local.x / unitsPerMillimetre;
            ras[1] = local.z / unitsPerMillimetre;
            ras[2] = local.y / unitsPerMillimetre;
        }

        /// <summary>A rotation of Unity's axes as a rotation of RAS axes (x, y, z, w in
        /// <paramref name="ras"/>): exchanging y and z and reversing the sense of turning.</summary>
        public static void FromUnity(Quaternion local, float* ras)
        {
            ras[0] = -local.x;
            ras[1] = -local.z;
            ras[2] = -local.y;
            ras[3] = local.w;
        }

        /// <summary>vertices[i] = rest[i] + displacement[i] in Unity's axes, <paramref name="stride"/> bytes from
        /// one vertex to the next; displacement is <c>[count,3]</c> mm.</summary>
        public static void Displace(Vector3* rest, float* displacement, byte* vertices, int stride, int count,
                                    float unitsPerMillimetre)
        {
            for (int i = 0; i < count; i++)
            {
                float* u = displacement + 3 * i;
                Vector3* vertex = (Vector3*)vertices;
                vertex->x = rest[i].x + u[0] * unitsPerMillimetre;
                vertex->y = rest[i].y + u[2] * unitsPerMillimetre;
                vertex->z = rest[i].z + u[1] * unitsPerMillimetre;
                vertices += stride;
            }
        }
    }
}
