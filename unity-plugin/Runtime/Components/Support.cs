using Upt.Interop;
using UnityEngine;

namespace Upt
{
    /// <summary>
    /// What a support group of the model does: its nodes go with this object as a rigid body, from where it is when the tissue starts, or are
    /// let go. It is in the list <see cref="SoftTissue.supports"/> of the tissue.
    /// </summary>
    public sealed class Support : MonoBehaviour
    {
        [Min(0)]
        [Tooltip("Which of the model's support groups, counted from 0 (bundle.json, 'supports').")]
        public int group;

        [Tooltip("The group holds nothing. Held again, it holds its nodes where they are then.")]
        public bool letGo;

        private Vector3 startPlace;
        private Quaternion startTurn;
        private Vector3 placeBefore;
        private Quaternion turnBefore;
        private Vector3 place;
        private Quaternion turn;
        private bool started;

        /// <summary>The tissue starts: where the object is now is where the group was meshed.</summary>
        internal void Begin()
        {
            started = false;
        }

        /// <summary>A frame of the tissue begins.</summary>
        internal void Look(Transform tissue)
        {
            placeBefore = place;
            turnBefore = turn;
            place = tissue.InverseTransformPoint(transform.position);
            turn = Quaternion.Inverse(tissue.rotation) * transform.rotation;
            if (started) return;
            started = true;
            startPlace = placeBefore = place;
            startTurn = turnBefore = turn;
        }

        /// <summary>The group at a part of the way from the last frame to this one, 1: now.</summary>
        internal unsafe SupportGroup At(float part, float unitsPerMillimetre)
        {
            // Where it was meshed, to the last bit: a group that does not move costs nothing.
            if (AtStart(placeBefore, turnBefore) && AtStart(place, turn)) return new SupportGroup { Group = group, LetGo = letGo };
            Quaternion now = Between(turnBefore, turn, part) * Quaternion.Inverse(startTurn);
            // A node x ends at now (x - start) + place.
            Vector3 moved = placeBefore + (place - placeBefore) * part - now * startPlace;
            float* position = stackalloc float[3];
            float* rotation = stackalloc float[4];
            Anatomical.FromUnity(moved, unitsPerMillimetre, position);
            Anatomical.FromUnity(now, rotation);
            return new SupportGroup {
                Group = group,
                LetGo = letGo,
                Position = (position[0], position[1], position[2]),
                Rotation = (rotation[0], rotation[1], rotation[2], rotation[3]),
            };
        }

        private bool AtStart(Vector3 at, Quaternion turned)
        {
            return at.x == startPlace.x && at.y == startPlace.y && at.z == startPlace.z && turned.x == startTurn.x &&
                   turned.y == startTurn.y && turned.z == startTurn.z && turned.w == startTurn.w;
        }

        internal static Quaternion Between(Quaternion from, Quaternion to, float part)
        {
            float sign = from.x * to.x + from.y * to.y + from.z * to.z + from.w * to.w < 0f ? -1f : 1f;
            float x = sign * from.x, y = sign * from.y, z = sign * from.z, w = sign * from.w;
            x += part * (to.x - x);
            y += part * (to.y - y);
            z += part * (to.z - z);
            w += part * (to.w - w);
            float size = 1f / (float)System.Math.Sqrt(x * x + y * y + z * z + w * w);
            return new Quaternion(x * size, y * size, z * size, w * size);
        }
    }
}
