using Upt.Interop;
using UnityEngine;

namespace Upt
{
    /// <summary>
    /// A straight blade: its edge goes from this object's place along its y axis, <see cref="length"/> millimetres, and cuts what it
    /// passes from step to step. With a <see cref="body"/> and a <see cref="threshold"/> it presses until it is pushed hard enough, then cuts.
    /// </summary>
    public sealed class Scalpel : EdgedCutter
    {
        [Min(0.1f)]
        [Tooltip("Of the edge, mm, from the object's place along its y axis.")]
        public float length = 20f;

        [Tooltip("The edge is sharp along the object's z axis only: within 60 degrees of it the blade cuts. Off: whatever way it goes.")]
        public bool oneEdged;

        [Min(0f)]
        [Tooltip("With how much the body must be pushed along z before a stroke cuts, mN. Needs the body.")]
        public float threshold;

        [Tooltip("The blade's body, an instrument of the tissue's list: presses while the blade does not cut, and is left out while it does. None: it only cuts.")]
        public Instrument body;

        private readonly float[] poses = new float[12];
        private readonly float[] before = new float[6];

        internal override upt_cut Work(Scene scene, SoftTissue tissue, int stroke, bool begins, double seconds)
        {
            float reach = length * tissue.unitsPerMillimetre;
            Put(tissue, transform.position, poses, 6);
            Put(tissue, transform.position + transform.rotation * new Vector3(0f, reach, 0f), poses, 9);
            upt_cut made = default(upt_cut);
            if (begins) Keep();
            System.Array.Copy(before, poses, 6);
            if (Sweeps(poses))
            {
                made = scene.CutWith(Sharp(tissue), stroke, poses, 2);
                if (made.is_changed == 0) made = default(upt_cut);
                Keep();
            }
            return made;
        }

        private void Keep()
        {
            System.Array.Copy(poses, 6, before, 0, 6);
        }

        private Blade Sharp(SoftTissue tissue)
        {
            Blade blade = new Blade { FractureEnergy = fractureEnergy, Threshold = threshold };
            Vector3 ahead = transform.rotation * new Vector3(0f, 0f, 1f);
            InstrumentReading reading;
            if (body != null && tissue.TryGetReading(body, out reading))
                blade.Pushed = System.Math.Max(0f, -Vector3.Dot(reading.force, ahead));
            if (!oneEdged) return blade;
            Vector3 local = Quaternion.Inverse(tissue.transform.rotation) * ahead;
            blade.Ahead = (local.x, local.z, local.y);
            return blade;
        }
    }
}
