using System;
using System.Collections.Generic;
using Upt.Interop;
using UnityEngine;

namespace Upt
{
    // What carries the tissue and hangs on it: its own object that moves, and beds.
    public sealed partial class SoftTissue
    {
        [Tooltip("The tissue feels how this object moves: what holds the organ goes with it. The model needs corrections.")]
        public bool carried;

        [Tooltip("Beds that hold this tissue, or that something hangs on. Read when the tissue starts.")]
        public List<Bed> beds = new List<Bed>();

        // All beds' ties, one after the other: a tie's place is its identity.
        private readonly List<Bed> hung = new List<Bed>();
        private upt_tie[] ties;
        private Vector3 placeBefore, placeNow;
        private Quaternion turnBefore, turnNow;
        private bool wasCarried;

        /// <summary>Makes the ties of the beds, of a tissue at rest.</summary>
        private void BeginBeds()
        {
            hung.Clear();
            ties = null;
            wasCarried = false;
            try
            {
                List<upt_tie> made = new List<upt_tie>();
                foreach (Bed bed in beds)
                {
                    if (bed == null || !bed.isActiveAndEnabled) continue;
                    int instrument = bed.hangs == null ? -1 : instruments.IndexOf(bed.hangs);
                    if (bed.hangs != null && instrument < 0)
                        throw new InvalidOperationException("put '" + bed.hangs.name + "', which hangs on bed '" + bed.name +
                                                            "', into the list 'Instruments'");
                    made.AddRange(bed.Make(scene, transform, unitsPerMillimetre, instrument));
                    hung.Add(bed);
                }
                if (made.Count > 0) ties = made.ToArray();
            }
            catch (Exception error)
            {
                hung.Clear();
                Fail("could not make its beds", error);
            }
        }

        /// <summary>What the beds' ties did in the step that has landed.</summary>
        private void TakeBeds()
        {
            if (ties == null) return;
            upt_tie_reading[] all = scene.TieReadings(ties.Length);
            int first = 0;
            foreach (Bed bed in hung)
            {
                bed.Take(all, first);
                first += bed.Count;
            }
        }

        /// <summary>A frame of the tissue begins.</summary>
        private void LookAtCarried()
        {
            placeBefore = wasCarried ? placeNow : transform.position;
            turnBefore = wasCarried ? turnNow : transform.rotation;
            placeNow = transform.position;
            turnNow = transform.rotation;
            wasCarried = true;
        }

        /// <summary>The beds of a step, and where this object is at a part of the way from the last frame to this one.</summary>
        private unsafe void Hold(ref StepInput input, float part)
        {
            input.Ties = ties;
            if (!carried) return;
            float* position = stackalloc float[3];
            float* rotation = stackalloc float[4];
            Anatomical.FromUnity(placeBefore + (placeNow - placeBefore) * part, unitsPerMillimetre, position);
            Anatomical.FromUnity(Support.Between(turnBefore, turnNow, part), rotation);
            input.SupportPosition = (position[0], position[1], position[2]);
            input.SupportRotation = (rotation[0], rotation[1], rotation[2], rotation[3]);
        }
    }
}
