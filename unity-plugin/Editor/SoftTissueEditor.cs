using Upt.Interop;
using UnityEditor;
using UnityEngine;

namespace Upt.Editor
{
    /// <summary>Inspector of <see cref="SoftTissue"/>: in play mode, step times per stage and the envelope
    /// flags in words.</summary>
    [CustomEditor(typeof(SoftTissue))]
    public sealed class SoftTissueEditor : UnityEditor.Editor
    {
        private static readonly string[] FlagNames = {
            "push beyond the trained range",
            "contact area beyond the trained range",
            "contact outside the trained domain",
            "instrument faster than the trained range",
            "more sites than the trained range",
            "guard: displacement bound",
            "guard: not finite",
            "guard: inverted elements",
            "guard: growth",
            "correction bounded",
            "contact block regularised",
            "corrections ended with inverted elements and were given up",
            "estimated error above the limit",
            "tissue more than 1 mm inside an instrument",
        };

        public override void OnInspectorGUI()
        {
            DrawDefaultInspector();
            SoftTissue tissue = (SoftTissue)target;
            if (!Application.isPlaying || !tissue.IsRunning) return;
            upt_scene_stats stats = tissue.LastStats;
            EditorGUILayout.LabelField("Step", tissue.LastTiming.step_ms.ToString("0.000") + " ms, " + tissue.ContactCount +
                                                   " contacts" + (stats.sleeping != 0 ? ", asleep" : ""));
            if (stats.corrections > 0)
                EditorGUILayout.LabelField("Corrections", stats.corrections + ", estimated error " +
                                                              stats.error_mm.ToString("0.000") + " mm");
            foreach (Instrument instrument in tissue.instruments)
            {
                InstrumentReading reading;
                if (tissue.TryGetReading(instrument, out reading))
                    EditorGUILayout.LabelField(instrument.name, reading.force.magnitude.ToString("0") + " mN, penetration " +
                                                                    reading.penetration.ToString("0.00") + " mm");
            }
            for (int i = 0; i < FlagNames.Length; i++)
                if ((stats.flags & (upt_flag)(1u << i)) != 0) EditorGUILayout.HelpBox(FlagNames[i], MessageType.Warning);
            Repaint();
        }

        public override bool RequiresConstantRepaint()
        {
            return Application.isPlaying;
        }

        /// <summary>In play mode: the border of the trained domain, green, or red when a flag is set, and a yellow cube
        /// at each contact.</summary>
        [DrawGizmo(GizmoType.Selected)]
        private static void DrawDomain(SoftTissue tissue, GizmoType kind)
        {
            if (!tissue.IsRunning) return;
            Gizmos.matrix = tissue.transform.localToWorldMatrix;
            Gizmos.color = tissue.LastStats.flags == 0 ? Color.green : Color.red;
            Vector3[] outline = tissue.DomainOutline();
            for (int i = 0; i + 1 < outline.Length; i += 2) Gizmos.DrawLine(outline[i], outline[i + 1]);
            Gizmos.color = Color.yellow;
            Vector3[] contacts = tissue.ContactPoints();
            float size = 2f * tissue.unitsPerMillimetre;
            for (int i = 0; i < contacts.Length; i++) Gizmos.DrawWireCube(contacts[i], new Vector3(size, size, size));
        }
    }
}
