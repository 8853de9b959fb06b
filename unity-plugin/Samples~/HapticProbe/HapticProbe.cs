using System;
using UnityEngine;

namespace Upt.Samples
{
    /// <summary>
    /// A simulated haptic device on a <see cref="HapticTool"/>: a handle with a mass, held by a hand that presses it into the tissue and lifts it
    /// again. Put it next to a HapticTool whose instrument is in a tissue's list, and press play. With a real device replace the
    /// body of <see cref="ReadPose"/> and <see cref="WriteWrench"/>, or call <c>HapticTool.Tick</c> from its servo callback:
    ///
    ///     hdBeginFrame(device);
    ///     hdGetDoublev(HD_CURRENT_TRANSFORM, transform);
    ///     HapticWrench wrench = tool.Tick(seconds, PoseOf(transform));
    ///     hdSetDoublev(HD_CURRENT_FORCE, ForceOf(wrench));
    ///     hdEndFrame(device);
    /// </summary>
    [RequireComponent(typeof(HapticTool))]
    public sealed class HapticProbe : MonoBehaviour
    {
        [Tooltip("How far the hand presses along the tool's forward axis, mm.")]
        public float depth = 6f;

        [Tooltip("Seconds of one press.")]
        public float period = 2f;

        /// <summary>kg, N/m and N s/m of handle and hand.</summary>
        private const float Mass = 0.1f, Stiffness = 400f, Damping = 6f;
        /// <summary>Longest step of the handle's motion, s.</summary>
        private const double Longest = 0.005;

        private Vector3 start;
        private Quaternion rotation;
        private Vector3 along;
        private Vector3 position;
        private Vector3 velocity;
        private Vector3 force;
        private double before;

        /// <summary>The last force on the hand, N.</summary>
        public Vector3 Force
        {
            get { return force; }
        }

        private void OnEnable()
        {
            start = transform.position;
            rotation = transform.rotation;
            along = rotation * new Vector3(0f, 0f, 1f);
            position = start;
            HapticTool tool = GetComponent<HapticTool>();
            tool.readPose = ReadPose;
            tool.writeWrench = WriteWrench;
        }

        /// <summary>The handle moves on to this moment. On the haptic thread.</summary>
        private HapticPose ReadPose(double seconds)
        {
            double left = Math.Min(seconds - before, 0.1);
            while (left > 0.0)
            {
                float dt = (float)Math.Min(left, Longest);
                float press = 0.5f - 0.5f * (float)Math.Cos(2.0 * Math.PI * seconds / period);
                Vector3 wanted = start + along * (0.001f * depth * press);
                Vector3 pull = (wanted - position) * Stiffness - velocity * Damping + force;
                velocity += pull * (dt / Mass);
                position += velocity * dt;
                left -= dt;
            }
            before = seconds;
            return new HapticPose { position = position, rotation = rotation };
        }

        /// <summary>The motors take the force. On the haptic thread.</summary>
        private void WriteWrench(HapticWrench wrench)
        {
            force = wrench.force;
        }
    }
}
