using Upt.Interop;
using UnityEngine;

namespace Upt
{
    /// <summary>An aspirator: takes the tissue that lies inside of a ball around this object's place, the deepest first.</summary>
    public sealed class Aspirator : Cutter
    {
        [Min(0.1f)]
        [Tooltip("Of the ball, mm.")]
        public float radius = 4f;

        [Min(0f)]
        [Tooltip("The most that it takes, mm³/s.")]
        public float rate = 500f;

        private readonly float[] place = new float[3];

        internal override unsafe upt_cut Work(Scene scene, SoftTissue tissue, int stroke, bool begins, double seconds)
        {
            Put(tissue, transform.position, place, 0);
            upt_instrument ball = default(upt_instrument);
            ball.shape = Native.UPT_SHAPE_SPHERE;
            for (int k = 0; k < 3; k++) ball.position[k] = place[k];
            ball.radius = radius;
            float most = (float)(rate * seconds);
            if (most <= 0f) return default(upt_cut);
            upt_cut made = scene.Remove(ball, most);
            return made.removed_mm3 > 0f ? made : default(upt_cut);
        }
    }
}
