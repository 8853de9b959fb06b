using UnityEngine;
using UnityEngine.Rendering;

namespace Upt.Samples
{
    /// <summary>
    /// The whole sample: put this on an empty object in an empty scene and press play. It builds the brain and, in front of the middle of its
    /// trained domain, a ball with a <see cref="HapticTool"/> and a <see cref="HapticProbe"/>: a simulated hand that presses it in and
    /// lifts it. Without a model asset it takes the bundle brain in StreamingAssets.
    /// </summary>
    public sealed class FeltBrain : MonoBehaviour
    {
        [Tooltip("The model asset. None: the bundle brain in StreamingAssets.")]
        public UptModel model;

        [Tooltip("Radius of the ball, mm.")]
        public float radius = 4f;

        private const float UnitsPerMillimetre = 0.001f;
        /// <summary>Between the ball and the tissue at rest, mm.</summary>
        private const float Clearance = 1f;
        private SoftTissue tissue;
        private HapticProbe probe;

        /// <summary>The tissue that the sample made.</summary>
        public SoftTissue Tissue
        {
            get { return tissue; }
        }

        /// <summary>The simulated hand that the sample made.</summary>
        public HapticProbe Probe
        {
            get { return probe; }
        }

        private void OnEnable()
        {
            if (model == null) model = ScriptableObject.CreateInstance<UptModel>();
            GameObject brain = new GameObject("Brain");
            brain.SetActive(false);
            brain.AddComponent<MeshFilter>();
            brain.AddComponent<MeshRenderer>().sharedMaterial = Paint(new Color(0.86f, 0.62f, 0.58f));
            tissue = brain.AddComponent<SoftTissue>();
            tissue.model = model;
            tissue.unitsPerMillimetre = UnitsPerMillimetre;

            GameObject hand = new GameObject("Probe");
            hand.SetActive(false);
            Instrument ball = hand.AddComponent<Instrument>();
            ball.shape = InstrumentShape.Capsule;
            ball.halfExtents = Vector3.zero;
            ball.radius = radius;
            hand.AddComponent<HapticTool>().tissue = tissue;
            probe = hand.AddComponent<HapticProbe>();
            probe.depth = 6f + Clearance;
            tissue.instruments.Add(ball);
            ShowBall(hand.transform);

            brain.SetActive(true);
            if (!tissue.IsRunning) return;
            Vector3 site, outward;
            tissue.DomainMiddle(out site, out outward);
            hand.transform.position = tissue.transform.TransformPoint(site + outward * ((radius + Clearance) * UnitsPerMillimetre));
            // The hand presses along its forward axis.
            hand.transform.rotation = Quaternion.LookRotation(outward * -1f, Vector3.up);
            Look(tissue.transform.TransformPoint(site), outward);
            hand.SetActive(true);
        }

        private void OnDisable()
        {
            if (probe != null) probe.gameObject.SetActive(false);
            if (tissue != null) tissue.gameObject.SetActive(false);
            if (probe != null) Object.Destroy(probe.gameObject);
            if (tissue != null) Object.Destroy(tissue.gameObject);
            probe = null;
            tissue = null;
        }

        /// <summary>A plain material of the render pipeline that the project uses.</summary>
        private static Material Paint(Color color)
        {
            Shader shader = GraphicsSettings.currentRenderPipeline != null
                                ? GraphicsSettings.currentRenderPipeline.defaultShader
                                : Shader.Find("Standard");
            Material material = new Material(shader);
            material.color = color;
            return material;
        }

        /// <summary>The instrument itself has no picture.</summary>
        private void ShowBall(Transform hand)
        {
            GameObject ball = GameObject.CreatePrimitive(PrimitiveType.Sphere);
            ball.transform.SetParent(hand, false);
            float width = 2f * radius * UnitsPerMillimetre;
            ball.transform.localScale = new Vector3(width, width, width);
            ball.GetComponent<MeshRenderer>().sharedMaterial = Paint(new Color(0.6f, 0.65f, 0.72f));
        }

        /// <summary>Turns the scene's camera to the site, 30 cm away.</summary>
        private static void Look(Vector3 middle, Vector3 outward)
        {
            Camera eye = Camera.main;
            if (eye == null) eye = new GameObject("Camera").AddComponent<Camera>();
            eye.nearClipPlane = 0.01f;
            Vector3 sideways = Vector3.Cross(outward, Vector3.up);
            eye.transform.position = middle + (outward + sideways + Vector3.up * 0.4f).normalized * 0.3f;
            eye.transform.rotation = Quaternion.LookRotation(middle - eye.transform.position, Vector3.up);
        }
    }
}
