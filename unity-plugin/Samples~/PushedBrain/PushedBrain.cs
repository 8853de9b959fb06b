using Upt.Interop;
using UnityEngine;
using UnityEngine.Rendering;

namespace Upt.Samples
{
    /// <summary>
    /// The whole sample: put this on an empty object in an empty scene, assign a UptModel asset, press play.
    /// It builds the brain and a spatula and looks at them with the scene's camera, or one of its own. The spatula
    /// presses and lifts by itself; while the left mouse button is held it stays pressed.
    /// </summary>
    public sealed class PushedBrain : MonoBehaviour
    {
        [Tooltip("The model asset (bundle brain, brain-reduced or brain-fast).")]
        public UptModel model;

        [Tooltip("Deepest push, mm.")]
        public float depth = 10f;

        [Tooltip("Seconds of one press.")]
        public float period = 4f;

        private const float UnitsPerMillimetre = 0.001f;
        private SoftTissue tissue;
        private Instrument spatula;
        private Vector3 site;
        private Vector3 outward;
        private float time;
        private bool found;

        /// <summary>The tissue that the sample made.</summary>
        public SoftTissue Tissue
        {
            get { return tissue; }
        }

        private void OnEnable()
        {
            if (model == null)
            {
                Debug.LogError("PushedBrain: assign a UptModel asset", this);
                return;
            }
            GameObject brain = new GameObject("Brain");
            brain.SetActive(false);
            brain.AddComponent<MeshFilter>();
            brain.AddComponent<MeshRenderer>().sharedMaterial = Paint(new Color(0.86f, 0.62f, 0.58f));
            found = false;
            tissue = brain.AddComponent<SoftTissue>();
            tissue.model = model;
            tissue.unitsPerMillimetre = UnitsPerMillimetre;

            GameObject tool = new GameObject("Spatula");
            spatula = tool.AddComponent<Instrument>();
            spatula.halfExtents = new Vector3(6f, 8f, 1.5f);
            spatula.radius = 1.5f;
            tissue.instruments.Add(spatula);
            ShowBlade(tool.transform);
            brain.SetActive(true);
            if (tissue.IsRunning) Find();
        }

        /// <summary>The place to press, once the tissue runs: in a WebGL player it comes from the web first.</summary>
        private void Find()
        {
            found = true;
            tissue.DomainMiddle(out site, out outward);
            Look();
        }

        private void OnDisable()
        {
            if (tissue != null) Object.Destroy(tissue.gameObject);
            if (spatula != null) Object.Destroy(spatula.gameObject);
        }

        private void Update()
        {
            if (tissue == null || !tissue.IsRunning) return;
            if (!found) Find();
            time += Time.deltaTime;
            float press = 0.5f - 0.5f * (float)System.Math.Cos(2.0 * System.Math.PI * time / period);
#if ENABLE_LEGACY_INPUT_MANAGER
            if (Input.GetMouseButton(0)) press = 1f;
#endif
            float clearance = (spatula.halfExtents.z + spatula.radius) * UnitsPerMillimetre;
            spatula.transform.position =
                tissue.transform.TransformPoint(site + outward * (clearance - press * depth * UnitsPerMillimetre));
            spatula.transform.rotation = Quaternion.LookRotation(outward, Vector3.up);
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

        /// <summary>A box as large as the spatula; the instrument itself has no picture.</summary>
        private void ShowBlade(Transform tool)
        {
            GameObject blade = GameObject.CreatePrimitive(PrimitiveType.Cube);
            Vector3 rounding = new Vector3(spatula.radius, spatula.radius, spatula.radius);
            blade.transform.SetParent(tool, false);
            blade.transform.localScale = (spatula.halfExtents + rounding) * (2f * UnitsPerMillimetre);
            blade.GetComponent<MeshRenderer>().sharedMaterial = Paint(new Color(0.6f, 0.65f, 0.72f));
        }

        /// <summary>Turns the scene's camera to the site, 30 cm away; the default camera stands 10 m off and cuts away what is
        /// nearer than 30 cm.</summary>
        private void Look()
        {
            Camera eye = Camera.main;
            if (eye == null) eye = new GameObject("Camera").AddComponent<Camera>();
            eye.nearClipPlane = 0.01f;
            Vector3 middle = tissue.transform.TransformPoint(site);
            Vector3 sideways = Vector3.Cross(outward, Vector3.up);
            eye.transform.position = middle + (outward + sideways + Vector3.up * 0.4f).normalized * 0.3f;
            eye.transform.rotation = Quaternion.LookRotation(middle - eye.transform.position, Vector3.up);
        }
    }
}
