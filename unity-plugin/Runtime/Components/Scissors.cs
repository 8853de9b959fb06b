using System;
using Upt.Interop;
using UnityEngine;

namespace Upt
{
    /// <summary>
    /// Scissors: two edges from this object's place, in its plane of y and z, each half of <see cref="opening"/> away from its y axis. While they
    /// close they cut what they pass, until they meet on that axis.
    /// </summary>
    public sealed class Scissors : EdgedCutter
    {
        [Min(0.1f)]
        [Tooltip("Of the edges, mm, from the object's place.")]
        public float length = 20f;

        [Range(0f, 90f)]
        [Tooltip("Angle between the edges, degrees. They cut while it becomes smaller.")]
        public float opening = 40f;

        private readonly float[] poses = new float[12];
        private float openBefore;

        internal override upt_cut Work(Scene scene, SoftTissue tissue, int stroke, bool begins, double seconds)
        {
            upt_cut made = default(upt_cut);
            if (!begins && opening < openBefore)
            {
                Blade blade = new Blade { FractureEnergy = fractureEnergy };
                foreach (int side in new[] { -1, 1 })
                {
                    Edge(tissue, 0.5f * side * openBefore, 0);
                    Edge(tissue, 0.5f * side * opening, 6);
                    if (Sweeps(poses)) Add(scene.CutWith(blade, stroke, poses, 2), ref made);
                }
            }
            openBefore = opening;
            return made;
        }

        private void Edge(SoftTissue tissue, float degrees, int at)
        {
            double angle = degrees * Math.PI / 180.0;
            float reach = length * tissue.unitsPerMillimetre;
            Vector3 along = new Vector3(0f, (float)Math.Cos(angle), (float)Math.Sin(angle)) * reach;
            Put(tissue, transform.position, poses, at);
            Put(tissue, transform.position + transform.rotation * along, poses, at + 3);
        }

        private static unsafe void Add(upt_cut one, ref upt_cut all)
        {
            if (one.is_changed == 0) return;
            all.node_count = one.node_count;
            all.copied_count += one.copied_count;
            all.area_mm2 += one.area_mm2;
            fixed (float* sum = all.force)
                for (int k = 0; k < 3; k++) sum[k] += one.force[k];
        }
    }
}
