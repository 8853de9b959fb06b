using UnityEngine;
using UnityEngine.Rendering;

namespace Upt.Samples
{
    /// <summary>
    /// Put this on an empty object in an empty scene, assign a UptModel asset, press play. It builds the brain and a scalpel, which cuts a slit into
    /// the middle of the domain, while a rod presses one lip aside; then the cut is undone, and it begins again.
    /// </summary>
    public sealed class CutBrain : MonoBehaviour
    {
        [Tooltip("The model asset (bundle brain-reduced).")]
        public UptModel model;

        [Tooltip("Depth of the slit, mm.")]
        public float depth = 8f;

        [Tooltip("Length of the slit, mm.")]
        public float length = 24f;

        [Tooltip("Seconds from one cut to the next.")]
        public float period = 8f;

        private const float UnitsPerMillimetre = 0.001f;
        private SoftTissue tissue;
        private Scalpel scalpel;
        private Instrument rod;
        private Vector3 site;
        private Vector3 outward;
        private Vector3 along;
        private float time;

        /// <summary>The tissue that the sample made.</summary>
        public SoftTissue Tissue
        {
            get { return tissue; }
        }

        /// <summary>Its scalpel.</summary>
        public Scalpel Scalpel
        {
            get { return scalpel; }
        }

        private void OnEnable()
        {
            if (model == null)
            {
                Debug.LogError("CutBrain: assign a UptModel asset", this);
                return;
            }
            GameObject brain = new GameObject("Brain");
            brain.SetActive(false);
            brain.AddComponent<MeshFilter>();
            brain.AddComponent<MeshRenderer>().sharedMaterial = Paint(new Color(0.86f, 0.62f, 0.58f));
            tissue = brain.AddComponent<SoftTissue>();
            tissue.model = model;
            tissue.unitsPerMillimetre = UnitsPerMillimetre;
            tissue.insideMaterial = Paint(new Color(0.55f, 0.13f, 0.12f));
            scalpel = new GameObject("Scalpel").AddComponent<Scalpel>();
            scalpel.active = false;
            tissue.cutters.Add(scalpel);
            rod = new GameObject("Rod").AddComponent<Instrument>();
            rod.shape = InstrumentShape.Capsule;
            rod.halfExtents = new Vector3(0f, 15f, 0f);
            rod.radius = 2f;
            tissue.instruments.Add(rod);
            brain.SetActive(true);
            tissue.DomainMiddle(out site, out outward);
            along = Vector3.Cross(outward, Vector3.up).normalized;
            Look();
        }

        private void OnDisable()
        {
            if (tissue != null) Object.Destroy(tissue.gameObject);
            if (scalpel != null) Object.Destroy(scalpel.gameObject);
            if (rod != null) Object.Destroy(rod.gameObject);
        }

        private void Update()
        {
            if (tissue == null || !tissue.IsRunning) return;
            time += Time.deltaTime;
            if (time > period)
            {
                time = 0f;
                tissue.Undo();
            }
            // A third cuts, a third presses a lip aside, a third lifts and waits.
            float part = 3f * time / period;
            scalpel.active = part < 1f;
            float way = (Clamped(part) - 0.5f) * length;
            scalpel.transform.position = World(way, 0f, -depth);
            scalpel.transform.rotation = Upright();
            float press = Clamped(part - 1f) - Clamped(part - 2f);
            rod.transform.position = World(0f, 5f, 18f - press * 6f);
            rod.transform.rotation = Upright();
        }

        /// <summary>A place, mm along the slit, aside of it and out of the tissue, from the middle of the domain.</summary>
        private Vector3 World(float ahead, float aside, float above)
        {
            Vector3 across = Vector3.Cross(outward, along);
            Vector3 local = site + (along * ahead + across * aside + outward * above) * UnitsPerMillimetre;
            return tissue.transform.TransformPoint(local);
        }

        /// <summary>The y axis out of the tissue.</summary>
        private Quaternion Upright()
        {
            return Quaternion.LookRotation(outward, Vector3.up) * Quaternion.AngleAxis(90f, new Vector3(1f, 0f, 0f));
        }

        private static float Clamped(float x)
        {
            return System.Math.Max(0f, System.Math.Min(1f, x));
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

        /// <summary>Turns the scene's camera to the site, 20 cm away.</summary>
        private void Look()
        {
            Camera eye = Camera.main;
            if (eye == null) eye = new GameObject("Camera").AddComponent<Camera>();
            eye.nearClipPlane = 0.01f;
            Vector3 middle = tissue.transform.TransformPoint(site);
            eye.transform.position = middle + (outward + along * 0.5f + Vector3.up * 0.6f).normalized * 0.2f;
            eye.transform.rotation = Quaternion.LookRotation(middle - eye.transform.position, Vector3.up);
        }
    }
}
