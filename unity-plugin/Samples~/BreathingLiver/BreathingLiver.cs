using UnityEngine;
using UnityEngine.Rendering;

namespace Upt.Samples
{
    /// <summary>
    /// Put this on an empty object in an empty scene, assign a UptModel asset, press play. It builds a liver that breathes, and a gall bladder, a ball here,
    /// that hangs on its bed. After a breath the gall bladder is drawn off, and the bed tears thread by thread.
    /// </summary>
    public sealed class BreathingLiver : MonoBehaviour
    {
        [Tooltip("The model asset (bundle liver-coarse).")]
        public UptModel model;

        [Tooltip("How far the liver goes up and down, mm.")]
        public float rise = 15f;

        [Tooltip("Seconds of one breath.")]
        public float period = 4f;

        [Tooltip("The gall bladder is drawn off after so long, s ...")]
        public float drawnAfter = 4f;

        [Tooltip("... and so fast, mm/s.")]
        public float speed = 10f;

        private const float UnitsPerMillimetre = 0.001f;
        private const float BladderRadius = 9f;
        private SoftTissue tissue;
        private Instrument bladder;
        private Bed bed;
        private Vector3 site;
        private Vector3 outward;
        private float time;

        /// <summary>The tissue that the sample made.</summary>
        public SoftTissue Tissue
        {
            get { return tissue; }
        }

        /// <summary>What the gall bladder hangs on.</summary>
        public Bed Bed
        {
            get { return bed; }
        }

        private void OnEnable()
        {
            if (model == null)
            {
                Debug.LogError("BreathingLiver: assign a UptModel asset", this);
                return;
            }
            time = 0f;
            GameObject liver = new GameObject("Liver");
            liver.SetActive(false);
            liver.AddComponent<MeshFilter>();
            liver.AddComponent<MeshRenderer>().sharedMaterial = Paint(new Color(0.52f, 0.17f, 0.14f));
            tissue = liver.AddComponent<SoftTissue>();
            tissue.model = model;
            tissue.unitsPerMillimetre = UnitsPerMillimetre;
            tissue.carried = true;
            bladder = new GameObject("Gall bladder").AddComponent<Instrument>();
            bladder.shape = InstrumentShape.Capsule;
            bladder.halfExtents = new Vector3(0f, 0f, 0f);
            bladder.radius = BladderRadius;
            tissue.instruments.Add(bladder);
            bed = new GameObject("Bed").AddComponent<Bed>();
            bed.hangs = bladder;
            Show(bladder.transform);
            liver.SetActive(true);
            // Only a tissue that runs knows where its domain is: the bed is made when it starts once more.
            tissue.DomainMiddle(out site, out outward);
            Place(0f);
            bed.transform.position = tissue.transform.TransformPoint(site);
            tissue.beds.Add(bed);
            tissue.ResetTissue();
            Look();
        }

        private void OnDisable()
        {
            if (tissue != null) Object.Destroy(tissue.gameObject);
            if (bladder != null) Object.Destroy(bladder.gameObject);
            if (bed != null) Object.Destroy(bed.gameObject);
        }

        private void Update()
        {
            if (tissue == null || !tissue.IsRunning) return;
            time += Time.deltaTime;
            float height = 0.5f * rise * (1f - (float)System.Math.Cos(2.0 * System.Math.PI * time / period));
            tissue.transform.position = Vector3.up * (height * UnitsPerMillimetre);
            Place(speed * System.Math.Max(0f, time - drawnAfter));
        }

        /// <summary>The gall bladder so far off its bed, mm; it breathes with the liver.</summary>
        private void Place(float off)
        {
            Vector3 local = site + outward * ((BladderRadius + 0.5f + off) * UnitsPerMillimetre);
            bladder.transform.position = tissue.transform.TransformPoint(local);
            bladder.transform.rotation = tissue.transform.rotation;
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

        /// <summary>A ball as large as the gall bladder; the instrument itself has no picture.</summary>
        private static void Show(Transform bladder)
        {
            GameObject ball = GameObject.CreatePrimitive(PrimitiveType.Sphere);
            ball.transform.SetParent(bladder, false);
            ball.transform.localScale = new Vector3(1f, 1f, 1f) * (2f * BladderRadius * UnitsPerMillimetre);
            ball.GetComponent<MeshRenderer>().sharedMaterial = Paint(new Color(0.36f, 0.46f, 0.22f));
        }

        /// <summary>Turns the scene's camera to the bed, 20 cm away.</summary>
        private void Look()
        {
            Camera eye = Camera.main;
            if (eye == null) eye = new GameObject("Camera").AddComponent<Camera>();
            eye.nearClipPlane = 0.01f;
            Vector3 middle = tissue.transform.TransformPoint(site);
            Vector3 sideways = Vector3.Cross(outward, Vector3.up);
            eye.transform.position = middle + (outward * 0.5f + sideways + Vector3.up * 0.3f).normalized * 0.2f;
            eye.transform.rotation = Quaternion.LookRotation(middle - eye.transform.position, Vector3.up);
        }
    }
}
