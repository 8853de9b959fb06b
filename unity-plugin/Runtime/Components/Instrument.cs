using Upt.Interop;
using UnityEngine;

namespace Upt
{
    /// <summary>Shape of an instrument's tip.</summary>
    public enum InstrumentShape
    {
        /// <summary>A cylinder with round ends, along the object's y axis.</summary>
        Capsule = 0,
        /// <summary>With sharp edges.</summary>
        Box = 1,
        /// <summary>A box whose edges are rounded.</summary>
        Spatula = 2,
        /// <summary>The convex hull of a collider's mesh.</summary>
        Hull = 3,
    }

    /// <summary>An instrument that pushes tissue: its pose is the transform's. Sizes are in
    /// millimetres.</summary>
    public sealed class Instrument : MonoBehaviour
    {
        [Tooltip("Capsule, box, spatula (a box with rounded corners), or the convex hull of a collider's mesh.")]
        public InstrumentShape shape = InstrumentShape.Spatula;

        [Tooltip("Half extents, mm. A capsule uses y: half its length without the caps.")]
        public Vector3 halfExtents = new Vector3(6f, 20f, 1f);

        [Tooltip("Radius of the capsule, or of the spatula's rounding, mm.")]
        public float radius = 1f;

        [Tooltip("Shape Hull: the collider whose mesh is used, on this object or on one that is fixed to it. Its mesh needs Read/Write.")]
        public MeshCollider hull;

        [Tooltip("Coulomb's coefficient of friction, 0 or more.")]
        public float friction = 0.2f;

        [Tooltip("Holds the tissue that is within 0.5 mm when this is turned on, until it is turned off or tears off.")]
        public bool grasp = false;

        [Tooltip("A grasp tears off when the tissue pulls harder than this, mN. 0: never.")]
        public float tearOff = 0f;

        [Tooltip("Only for models without a linear response: tissue in contact sticks to the instrument instead of sliding along it.")]
        public bool sticking = false;

        private Hull made;
        private Mesh madeOf;
        private float madeAt;

        private float shownScale = 0.001f;

        /// <summary>The instrument in the axes and units of <paramref name="tissue"/>'s bundle.</summary>
        public unsafe upt_instrument PoseIn(Transform tissue, float unitsPerMillimetre)
        {
            shownScale = unitsPerMillimetre;
            upt_instrument instrument = default(upt_instrument);
            instrument.struct_size = (uint)sizeof(upt_instrument);
            instrument.shape = (upt_shape)shape;
            Anatomical.FromUnity(tissue.InverseTransformPoint(transform.position), unitsPerMillimetre,
                                 instrument.position);
            Anatomical.FromUnity(Quaternion.Inverse(tissue.rotation) * transform.rotation, instrument.rotation);
            // The map exchanges the second and third axis, and so the extents along them.
            instrument.half_extents[0] = halfExtents.x;
            instrument.half_extents[1] = shape == InstrumentShape.Capsule ? halfExtents.y : halfExtents.z;
            instrument.half_extents[2] = shape == InstrumentShape.Capsule ? halfExtents.z : halfExtents.y;
            if (shape == InstrumentShape.Capsule) TurnCapsule(ref instrument);
            instrument.radius = radius;
            instrument.sticking = (byte)(sticking ? 1 : 0);
            instrument.friction = friction;
            instrument.mode = grasp ? Native.UPT_MODE_GRASP : Native.UPT_MODE_SLIDE;
            instrument.tear_off_mn = tearOff;
            if (shape == InstrumentShape.Hull) instrument.hull = HullAt(unitsPerMillimetre);
            return instrument;
        }

        /// <summary>The rotation of a tool that lies as <paramref name="local"/> in the tissue's space; no other field. From any
        /// thread.</summary>
        internal unsafe upt_instrument TurnedAs(Quaternion local)
        {
            upt_instrument instrument = default(upt_instrument);
            Anatomical.FromUnity(local, instrument.rotation);
            if (shape == InstrumentShape.Capsule) TurnCapsule(ref instrument);
            return instrument;
        }

        private void OnDisable()
        {
            if (made != null) made.Dispose();
            made = null;
        }

        /// <summary>The hull of the collider's mesh; made once for a mesh and a scale.</summary>
        private unsafe System.IntPtr HullAt(float unitsPerMillimetre)
        {
            Mesh mesh = hull == null ? null : hull.sharedMesh;
            if (mesh == null)
                throw new System.InvalidOperationException("instrument '" + name + "': assign a MeshCollider with a mesh to the field 'Hull'");
            if (made != null && madeOf == mesh && madeAt == unitsPerMillimetre) return made.Pointer;
            if (!mesh.isReadable)
                throw new System.InvalidOperationException("instrument '" + name + "': turn on Read/Write in the import settings of mesh '" + mesh.name + "'");
            Vector3[] vertices = mesh.vertices;
            float[] points = new float[3 * vertices.Length];
            Quaternion turn = Quaternion.Inverse(transform.rotation);
            fixed (float* p = points)
                for (int i = 0; i < vertices.Length; i++)
                    Anatomical.FromUnity(turn * (hull.transform.TransformPoint(vertices[i]) - transform.position),
                                         unitsPerMillimetre, p + 3 * i);
            if (made != null) made.Dispose();
            made = new Hull(points);
            madeOf = mesh;
            madeAt = unitsPerMillimetre;
            return made.Pointer;
        }

        /// <summary>A Unity capsule lies along Unity's y, which is RAS z; the library's lies along its own
        /// local y: a quarter turn about x brings one to the other.</summary>
        private static unsafe void TurnCapsule(ref upt_instrument instrument)
        {
            const float half = 0.70710678f;
            fixed (float* q = instrument.rotation)
            {
                float x = q[0], y = q[1], z = q[2], w = q[3];
                q[0] = w * half + x * half;
                q[1] = y * half + z * half;
                q[2] = z * half - y * half;
                q[3] = w * half - x * half;
            }
        }

        private void OnDrawGizmosSelected()
        {
            // Sizes are millimetres of tissue: the transform's own scale has no part in them.
            Gizmos.matrix = Matrix4x4.TRS(transform.position, transform.rotation, new Vector3(shownScale, shownScale, shownScale));
            Gizmos.color = Color.cyan;
            if (shape == InstrumentShape.Hull) return; // the collider draws itself
            if (shape == InstrumentShape.Capsule)
            {
                Vector3 half = new Vector3(0f, halfExtents.y, 0f);
                Gizmos.DrawWireSphere(half, radius);
                Gizmos.DrawWireSphere(-half, radius);
                DrawSide(half, new Vector3(radius, 0f, 0f));
                DrawSide(half, new Vector3(0f, 0f, radius));
                return;
            }
            float rounding = shape == InstrumentShape.Spatula ? radius : 0f;
            Gizmos.DrawWireCube(Vector3.zero, (halfExtents + new Vector3(rounding, rounding, rounding)) * 2f);
        }

        private static void DrawSide(Vector3 half, Vector3 outward)
        {
            Gizmos.DrawLine(outward - half, outward + half);
            Gizmos.DrawLine(-outward - half, half - outward);
        }
    }
}
