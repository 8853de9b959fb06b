using Upt.Interop;
using UnityEngine;

namespace Upt
{
    /// <summary>
    /// A bed: what holds a region of the tissue's surface to the tissue's own frame, or to an instrument, as a gall bladder hangs on a liver. It is many
    /// ties, and tears node by node from where it is pulled. Its region is a ball about this object where the tissue starts. It is in the list
    /// <see cref="SoftTissue.beds"/> of the tissue, whose model needs corrections.
    /// </summary>
    public sealed class Bed : MonoBehaviour
    {
        [Min(0f)]
        [Tooltip("Radius of the region, mm.")]
        public float radius = 15f;

        [Min(0f)]
        [Tooltip("Stiffness of the whole bed, N/m.")]
        public float stiffness = 300f;

        [Min(0f)]
        [Tooltip("The whole bed breaks under so much tension, mN. 0: never.")]
        public float breakForce = 400f;

        [Min(0f)]
        [Tooltip("Damping of the whole bed, N s/m.")]
        public float damping;

        [Tooltip("What hangs on it: one of the tissue's instruments. None: the bed goes with the tissue's object.")]
        public Instrument hangs;

        private upt_tie[] ties = new upt_tie[0];
        private upt_tie_reading[] readings = new upt_tie_reading[0];

        /// <summary>Ties that it is made of; 0 before the tissue starts.</summary>
        public int Count
        {
            get { return ties.Length; }
        }

        /// <summary>How many of them have torn.</summary>
        public int Torn
        {
            get
            {
                int torn = 0;
                foreach (upt_tie_reading reading in readings) torn += reading.broken;
                return torn;
            }
        }

        /// <summary>What it pulls the tissue with in the last finished step, mN, in the axes of the tissue's object.</summary>
        public unsafe Vector3 Force
        {
            get
            {
                Vector3 sum = default(Vector3);
                foreach (upt_tie_reading reading in readings)
                    sum += Anatomical.ToUnity(reading.force[0], reading.force[1], reading.force[2], 1f);
                return sum;
            }
        }

        /// <summary>The bed's ties on a tissue that starts; <paramref name="instrument"/> is the place of <see cref="hangs"/> in its list,
        /// -1: not there.</summary>
        internal unsafe upt_tie[] Make(Scene scene, Transform tissue, float unitsPerMillimetre, int instrument)
        {
            upt_bed region = default(upt_bed);
            Anatomical.FromUnity(tissue.InverseTransformPoint(transform.position), unitsPerMillimetre, region.centre);
            region.radius_mm = radius;
            region.stiffness = stiffness;
            region.break_mn = breakForce;
            region.damping = damping;
            ties = scene.Bed(region);
            readings = new upt_tie_reading[0];
            if (instrument < 0) return ties;
            upt_instrument end = hangs.PoseIn(tissue, unitsPerMillimetre);
            for (int i = 0; i < ties.Length; i++)
            {
                fixed (float* place = ties[i].place) ToFrame(end, place);
                ties[i].to = Native.UPT_END_INSTRUMENT;
                ties[i].instrument = (uint)instrument;
            }
            return ties;
        }

        /// <summary>Takes what its ties did, which begin at <paramref name="first"/> of all.</summary>
        internal void Take(upt_tie_reading[] all, int first)
        {
            if (readings.Length != ties.Length) readings = new upt_tie_reading[ties.Length];
            System.Array.Copy(all, first, readings, 0, ties.Length);
        }

        /// <summary>A place of the bundle becomes the same place in an instrument's frame.</summary>
        private static unsafe void ToFrame(upt_instrument frame, float* place)
        {
            float x = place[0] - frame.position[0], y = place[1] - frame.position[1], z = place[2] - frame.position[2];
            // Turned back: v + 2 w (q x v) + 2 q x (q x v) with the conjugate's q.
            float i = -frame.rotation[0], j = -frame.rotation[1], k = -frame.rotation[2], w = frame.rotation[3];
            float a = 2f * (j * z - k * y), b = 2f * (k * x - i * z), c = 2f * (i * y - j * x);
            place[0] = x + w * a + j * c - k * b;
            place[1] = y + w * b + k * a - i * c;
            place[2] = z + w * c + i * b - j * a;
        }

        private void OnDrawGizmosSelected()
        {
            Gizmos.matrix = Matrix4x4.TRS(transform.position, transform.rotation, new Vector3(0.001f, 0.001f, 0.001f));
            Gizmos.color = Color.cyan;
            Gizmos.DrawWireSphere(new Vector3(0f, 0f, 0f), radius);
        }
    }
}
