using System;
using System.Collections.Generic;
using Upt.Interop;
using Unity.Profiling;
using UnityEngine;

namespace Upt
{
    /// <summary>
    /// Soft tissue on this object's mesh. Steps run on the scene's worker at the model's own rate (20 Hz);
    /// the frame only samples between the last two states and uploads the vertices. The picture is
    /// therefore one step (50 ms) behind the instruments.
    /// </summary>
    [RequireComponent(typeof(MeshFilter))]
    public sealed class SoftTissue : MonoBehaviour
    {
        [Tooltip("The model asset.")]
        public UptModel model;

        [Tooltip("Mesh to deform, in this object's local space, lying in the bundle's volume. None: the bundle's surface.")]
        public Mesh renderMesh;

        [Tooltip("Unity units per millimetre.")]
        public float unitsPerMillimetre = 0.001f;

        [Tooltip("Instruments that push this tissue.")]
        public List<Instrument> instruments = new List<Instrument>();

        [Tooltip("Recompute normals each frame.")]
        public bool recalculateNormals = true;

        private static readonly ProfilerMarker FrameMarker = new ProfilerMarker("libupt.Frame");
        private static readonly ProfilerMarker ContactMarker = new ProfilerMarker("libupt.Contacts");
        private static readonly ProfilerMarker UploadMarker = new ProfilerMarker("libupt.Upload");

        private Model nativeModel;
        private float[] restPositions;
        private Scene scene;
        private SurfaceMesh surface;
        private upt_instrument[] poses = new upt_instrument[4];
        private uint[] contactNodes;
        private float[] contactVectors;
        private int contactCount;
        private bool inFlight;
        private bool failed;
        private double clock;
        private double dt;

        /// <summary>Statistics of the last finished step: stage times in ms, envelope flags.</summary>
        public upt_scene_stats LastStats { get; private set; }

        /// <summary>Nodes in contact in the last submitted step.</summary>
        public int ContactCount
        {
            get { return contactCount; }
        }

        /// <summary>True while the tissue is simulated; false after an error, which is in the console.</summary>
        public bool IsRunning
        {
            get { return scene != null && !failed; }
        }

        /// <summary>Corners of the trained domain's triangles at rest, local space, 3 a triangle. Allocates:
        /// for gizmos.</summary>
        public Vector3[] DomainPoints()
        {
            if (scene == null) return new Vector3[0];
            return RestPoints(nativeModel.Indices(Native.UPT_SET_DOMAIN_FACES), int.MaxValue);
        }

        /// <summary>Where the nodes in contact are taken, local space. Allocates: for gizmos.</summary>
        public Vector3[] ContactPoints()
        {
            if (scene == null) return new Vector3[0];
            Vector3[] points = RestPoints(contactNodes, contactCount);
            for (int i = 0; i < points.Length; i++)
                points[i] += Anatomical.ToUnity(contactVectors[3 * i], contactVectors[3 * i + 1],
                                                contactVectors[3 * i + 2], unitsPerMillimetre);
            return points;
        }

        private void OnEnable()
        {
            failed = false;
            try
            {
                Open();
            }
            catch (Exception error)
            {
                Fail("could not start", error);
                Close();
            }
        }

        private void OnDisable()
        {
            Close();
        }

        private void Update()
        {
            if (!IsRunning) return;
            using (FrameMarker.Auto())
            {
                try
                {
                    Advance(Time.deltaTime);
                }
                catch (Exception error)
                {
                    Fail("stopped", error);
                }
            }
        }

        /// <summary>Back to rest.</summary>
        public void ResetTissue()
        {
            if (scene == null) return;
            if (inFlight) scene.Wait(uint.MaxValue);
            inFlight = false;
            scene.Reset();
            failed = false;
            clock = 0.0;
        }

        private void Open()
        {
            if (model == null)
                throw new InvalidOperationException("assign a UptModel asset to the field 'Model'");
            Model native = model.Acquire();
            try
            {
                scene = new Scene(native);
                surface = new SurfaceMesh(native, renderMesh, unitsPerMillimetre);
                scene.AttachPoints(surface.PointsInBundle());
                int capacity = native.Indices(Native.UPT_SET_SURFACE_NODES).Length;
                contactNodes = new uint[capacity];
                contactVectors = new float[3 * capacity];
                dt = native.Info.dt;
                nativeModel = native;
                GetComponent<MeshFilter>().sharedMesh = surface.Mesh;
            }
            catch (Exception)
            {
                model.Release();
                throw;
            }
        }

        private void Close()
        {
            bool opened = contactNodes != null;
            if (scene != null) scene.Dispose();
            if (surface != null) surface.Dispose();
            scene = null;
            surface = null;
            nativeModel = null;
            restPositions = null;
            contactNodes = null;
            inFlight = false;
            if (opened && model != null) model.Release();
        }

        private void Advance(float deltaTime)
        {
            clock += deltaTime;
            if (inFlight && scene.Poll())
            {
                inFlight = false;
                LastStats = scene.Stats();
                StepCounters.Add(LastStats);
            }
            if (!inFlight && clock >= dt)
            {
                // A frame that took longer than a step does not ask for two: the tissue would run after the clock.
                clock = Math.Min(clock - dt, dt);
                using (ContactMarker.Auto()) GatherContacts();
                scene.Submit(contactNodes, contactVectors, contactCount);
                inFlight = true;
            }
            using (UploadMarker.Auto()) surface.Upload(scene, Math.Min(1.0, clock / dt), recalculateNormals);
        }

        private void GatherContacts()
        {
            if (poses.Length < instruments.Count) poses = new upt_instrument[2 * instruments.Count];
            int count = 0;
            for (int i = 0; i < instruments.Count; i++)
                if (instruments[i] != null && instruments[i].isActiveAndEnabled)
                    poses[count++] = instruments[i].PoseIn(transform, unitsPerMillimetre);
            contactCount = count == 0 ? 0 : scene.ContactsFrom(poses, count, contactNodes, contactVectors);
        }

        private Vector3[] RestPoints(uint[] nodes, int limit)
        {
            if (restPositions == null) restPositions = nativeModel.Positions();
            Vector3[] points = new Vector3[Math.Min(limit, nodes.Length)];
            for (int i = 0; i < points.Length; i++)
            {
                long at = 3L * nodes[i];
                points[i] = Anatomical.ToUnity(restPositions[at], restPositions[at + 1], restPositions[at + 2],
                                               unitsPerMillimetre);
            }
            return points;
        }

        private void Fail(string what, Exception error)
        {
            failed = true;
            Debug.LogError("libupt: soft tissue '" + name + "' " + what + ": " + error.Message, this);
        }
    }
}
