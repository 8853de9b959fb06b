using System;
using Upt.Interop;
using UnityEngine;

namespace Upt
{
    /// <summary>
    /// What changes the body of a tissue: <see cref="Scalpel"/>, <see cref="Scissors"/>, <see cref="Aspirator"/>. It is in the list
    /// <see cref="SoftTissue.cutters"/> of the tissue, which lets it work before each step. What it does from when it begins to work until it
    /// rests is one stroke, which <see cref="SoftTissue.Undo"/> takes back.
    /// </summary>
    public abstract class Cutter : MonoBehaviour
    {
        [Tooltip("Works while this is on.")]
        public bool active = true;

        /// <summary>Whether it has changed the tissue in the last step.</summary>
        public bool IsWorking { get; private set; }

        /// <summary>What the tissue does to it, mN, world axes.</summary>
        public Vector3 Force { get; private set; }

        /// <summary>New area that it has laid open, mm².</summary>
        public float CutArea { get; private set; }

        /// <summary>Volume that it has taken, mm³.</summary>
        public float RemovedVolume { get; private set; }

        internal bool IsInStroke { get; private set; }

        /// <summary>Its stroke has been undone while it was at work: it waits until it is not.</summary>
        internal bool IsUndone;

        /// <summary>Number of the stroke that goes on, and the body before it, until it has changed.</summary>
        internal int Stroke;
        internal byte[] Before;

        /// <summary>Works on the scene, in which no step is in flight; <paramref name="stroke"/> is its own while it works, and new
        /// where <paramref name="begins"/>. What it returns with a node count of 0 has changed nothing.</summary>
        internal abstract upt_cut Work(Scene scene, SoftTissue tissue, int stroke, bool begins, double seconds);

        /// <summary>Whether it takes part in the step that is about to be made.</summary>
        internal bool IsReady
        {
            get { return active && isActiveAndEnabled; }
        }

        internal unsafe void Note(upt_cut made, Quaternion tissue)
        {
            IsInStroke = true;
            IsWorking = made.node_count > 0;
            Force = IsWorking ? tissue * Anatomical.ToUnity(made.force[0], made.force[1], made.force[2], 1f) : Vector3.zero;
            CutArea += made.area_mm2;
            RemovedVolume += made.removed_mm3;
        }

        internal void Rest()
        {
            IsInStroke = false;
            IsWorking = false;
            Before = null;
            Force = Vector3.zero;
        }

        /// <summary>Millimetres of the tissue's bundle of a point of the world, written to <paramref name="poses"/> from
        /// <paramref name="at"/> on.</summary>
        internal static unsafe void Put(SoftTissue tissue, Vector3 world, float[] poses, int at)
        {
            fixed (float* p = poses)
                Anatomical.FromUnity(tissue.transform.InverseTransformPoint(world), tissue.unitsPerMillimetre, p + at);
        }
    }

    /// <summary>A cutter whose edges go from pose to pose.</summary>
    public abstract class EdgedCutter : Cutter
    {
        [Min(0f)]
        [Tooltip("What new area takes, J/m²: the blade feels it, and the tissue is pushed ahead of it. 0: nothing.")]
        public float fractureEnergy = 10f;

        /// <summary>An edge that goes less far from step to step waits, mm.</summary>
        private const float Still = 0.02f;

        /// <summary>One that goes farther has been put there, mm.</summary>
        private const float Leap = 40f;

        /// <summary>Whether an edge has swept an area between two places, <c>[2,2,3]</c> mm.</summary>
        internal static bool Sweeps(float[] poses)
        {
            float most = 0f, area = 0f, length = 0f;
            float[] across = new float[6];
            for (int end = 0; end < 2; end++)
            {
                float far = 0f;
                for (int k = 0; k < 3; k++) far += Square(poses[6 + 3 * end + k] - poses[3 * end + k]);
                most = Math.Max(most, (float)Math.Sqrt(far));
                for (int k = 0; k < 3; k++) across[3 * end + k] = poses[9 - 3 * end + k] - poses[3 * end + k];
            }
            for (int k = 0; k < 3; k++)
            {
                int a = (k + 1) % 3, b = (k + 2) % 3;
                area += Square(across[a] * across[3 + b] - across[b] * across[3 + a]);
                length += Square(poses[3 + k] - poses[k]);
            }
            // Half of the cross product of its diagonals is a quadrilateral's area.
            return most <= Leap && 0.5 * Math.Sqrt(area) > Still * Math.Sqrt(length);
        }

        private static float Square(float x)
        {
            return x * x;
        }
    }
}
