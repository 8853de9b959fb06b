using System;
using System.Collections.Generic;
using Upt.Interop;
using Unity.Profiling;
using UnityEngine;

namespace Upt
{
    /// <summary>
    /// Soft tissue on this object's mesh. Steps run on the scene's worker, as many a second as the model recommends for
    /// frames (<see cref="stepSeconds"/>); each frame shows the tissue at its own moment, with the instruments where they are
    /// then. Models without corrections cannot: there a frame lies between the last two states, one step (50 ms) and the
    /// time that a step takes behind the instruments.
    /// </summary>
    [RequireComponent(typeof(MeshFilter))]
    public sealed partial class SoftTissue : MonoBehaviour
    {
        [Tooltip("The model asset.")]
        public UptModel model;

        [Tooltip("Mesh to deform, in this object's local space, lying in the bundle's volume. None: the MeshFilter's; " +
                 "if it has none either, the bundle's surface.")]
        public Mesh renderMesh;

        [Tooltip("Unity units per millimetre.")]
        public float unitsPerMillimetre = 0.001f;

        [Tooltip("Instruments that push this tissue.")]
        public List<Instrument> instruments = new List<Instrument>();

        [Range(-1, 64)]
        [Tooltip("The most corrections by the elements that a step in contact gets: 1 to 64; 0: what the bundle recommends, with its own " +
                 "target; -1: none, the fastest and least accurate. Read when the tissue starts.")]
        public int corrections;

        [Min(0f)]
        [Tooltip("With corrections from 1: fewer once the estimated error is below this, mm; 0: always that many.")]
        public float correctionsTarget;

        [Range(0, 8)]
        [Tooltip("The most shorter steps that replace a step under instruments, where one step would miss the target: 2 to 8; 1: none; " +
                 "0: what the bundle recommends. 2 or more need a target.")]
        public int substeps;

        [Min(0f)]
        [Tooltip("Damping of the tissue, 1/s: 0.01 to 1000; with less it swings longer. 0: the bundle's. Needs corrections.")]
        public float damping;

        [Range(0f, 0.05f)]
        [Tooltip("Length of a step, seconds: 0.01 to 0.05, shorter ones lag less and take more of the processor; 0: what the model " +
                 "recommends for frames. Another than the model's own needs corrections.")]
        public float stepSeconds;

        [Tooltip("Recompute normals each frame.")]
        public bool recalculateNormals = true;

        /// <summary>Steps that a frame makes itself at most where frames come slower than steps.</summary>
        private const int MostMade = 2;

        private static readonly ProfilerMarker FrameMarker = new ProfilerMarker("libupt.Frame");
        private static readonly ProfilerMarker ContactMarker = new ProfilerMarker("libupt.Contacts");
        private static readonly ProfilerMarker UploadMarker = new ProfilerMarker("libupt.Upload");

        private bool acquired;
        private RestGeometry geometry;
        private Scene scene;
        private SurfaceMesh surface;
        private Mesh shownBefore;
        private Playhead playhead;
        private FrameClock clock;
        private double now;
        private bool presents;
        private upt_instrument[] poses = new upt_instrument[4];
        private upt_instrument[] stepPoses = new upt_instrument[4];
        private uint[] touchable;
        private uint[] contactNodes;
        private float[] contactVectors;
        private int contactCount;
        private bool solvesContact;
        private Instrument[] places = new Instrument[4];
        private upt_instrument_reading[] readings = new upt_instrument_reading[4];
        private upt_instrument_contact[] pushes = new upt_instrument_contact[64];
        private int submittedCount;
        private int readingCount;
        private bool inFlight;
        private bool refused;
        private bool failed;

        /// <summary>Statistics of the last finished step, envelope flags among them.</summary>
        public upt_scene_stats LastStats { get; private set; }

        /// <summary>What the last finished step and its stages took, ms.</summary>
        public upt_scene_timing LastTiming { get; private set; }

        /// <summary>Whether the model solves the contact of instruments. Others (models without a linear response) take the
        /// nodes that instruments touch, and have no readings.</summary>
        public bool SolvesContact
        {
            get { return solvesContact; }
        }

        /// <summary>Whether frames show the present moment, without lag.</summary>
        public bool Presents
        {
            get { return presents; }
        }

        /// <summary>What the tissue did to <paramref name="instrument"/> in the last finished step; false where it took
        /// no part in it.</summary>
        public bool TryGetReading(Instrument instrument, out InstrumentReading reading)
        {
            for (int i = 0; i < readingCount; i++)
            {
                if (instrument == null || places[i] != instrument) continue;
                reading = InstrumentReading.From(readings[i], transform.rotation);
                return true;
            }
            reading = default(InstrumentReading);
            return false;
        }

        /// <summary>Points of the tissue that push or hold instruments in the last finished step; where contact is not
        /// solved, nodes in contact in the last submitted one.</summary>
        public int ContactCount
        {
            get { return contactCount; }
        }

        /// <summary>True while the tissue is simulated; false after an error, which is in the console.</summary>
        public bool IsRunning
        {
            get { return scene != null && !failed; }
        }

        /// <summary>Corners of the trained domain's triangles at rest, local space, 3 a triangle.
        /// Allocates.</summary>
        public Vector3[] DomainPoints()
        {
            return geometry == null ? new Vector3[0] : geometry.DomainCorners();
        }

        /// <summary>The middle of the trained domain at rest, and the direction out of the tissue there, local space: a place
        /// to begin with a tool. The origin and up where the tissue does not run or has no domain. Allocates.</summary>
        public void DomainMiddle(out Vector3 middle, out Vector3 outward)
        {
            middle = Vector3.zero;
            outward = Vector3.up;
            if (geometry != null) geometry.DomainMiddle(ref middle, ref outward);
        }

        /// <summary>The border of the trained domain at rest, local space, 2 ends a line. The array is the
        /// component's own: for gizmos.</summary>
        public Vector3[] DomainOutline()
        {
            return geometry == null ? new Vector3[0] : geometry.DomainOutline();
        }

        /// <summary>Where the tissue touches instruments, local space. Allocates: for gizmos.</summary>
        public unsafe Vector3[] ContactPoints()
        {
            if (solvesContact)
            {
                Vector3[] points = new Vector3[contactCount];
                for (int i = 0; i < contactCount; i++)
                    fixed (float* p = pushes[i].position)
                        points[i] = Anatomical.ToUnity(p[0], p[1], p[2], unitsPerMillimetre);
                return points;
            }
            return geometry == null ? new Vector3[0] : geometry.Displaced(contactNodes, contactVectors, contactCount);
        }

        /// <summary>Lets a hand feel <paramref name="instrument"/>, one of the list; null where this tissue does not run or cannot
        /// (<see cref="Presents"/>). Waits for a step in flight. The caller disposes it.</summary>
        internal Haptics MakeHaptics(Instrument instrument, float forceLimit)
        {
            int place = instruments.IndexOf(instrument);
            if (!IsRunning || !presents || place < 0) return null;
            if (inFlight) scene.Wait(uint.MaxValue);
            upt_haptics_options options = default(upt_haptics_options);
            options.force_limit_n = forceLimit;
            return scene.MakeHaptics(place, instrument.PoseIn(transform, unitsPerMillimetre), options);
        }

        private void OnEnable()
        {
            failed = false;
            Begin();
        }

        // Where a model comes from the web, once it is here.
        private void Begin()
        {
            try
            {
                if (model == null || model.IsReady) Open();
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
            if (scene == null && !failed) Begin();
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

        /// <summary>Back to rest; also starts a tissue again that an error has stopped.</summary>
        public void ResetTissue()
        {
            if (scene == null) return;
            try
            {
                if (inFlight) scene.Wait(uint.MaxValue);
            }
            catch (UptException)
            {
                // The error of a step whose state is thrown away.
            }
            inFlight = false;
            refused = false;
            failed = false;
            scene.Reset();
            readingCount = 0;
            contactCount = 0;
            ReadStats();
            playhead = new Playhead(playhead.Step);
            clock = new FrameClock(playhead.Step);
            Heal();
        }

        private void Open()
        {
            if (model == null)
                throw new InvalidOperationException("assign a UptModel asset to the field 'Model'");
            if (transform.localToWorldMatrix.determinant < 0f)
                Debug.LogWarning("libupt: soft tissue '" + name + "' is mirrored: the scale of its transform, or of one above it, is negative. " +
                                     "Left and right of the organ are exchanged, and poses and forces do not follow a mirror; " +
                                     "make the scale positive",
                                 this);
            Model native = model.Acquire();
            acquired = true;
            MeshFilter filter = GetComponent<MeshFilter>();
            shownBefore = filter.sharedMesh;
            surface = new SurfaceMesh(native, renderMesh != null ? renderMesh : shownBefore, unitsPerMillimetre);
            // Render vertices between nodes are interpolated: decoding them costs a step more and is no more accurate.
            // What the model recommends for frames takes its corrections.
            double step = corrections < 0 ? native.Info.dt : native.Info.frame_step_s;
            if (stepSeconds != 0f) step = stepSeconds;
            scene = new Scene(native, new upt_scene_options {
                interpolate_points = 1,
                corrections = Corrections.Of(corrections, correctionsTarget),
                substeps = (byte)substeps,
                damping_per_s = damping,
                step_s = step,
            });
            solvesContact = Solves(scene);
            touchable = native.Indices(Native.UPT_SET_SURFACE_NODES);
            // What instruments touch; the attached points' nodes are decoded beside it, the rest of the volume is not.
            scene.SetRegion(touchable);
            scene.AttachPoints(surface.PointsInBundle());
            contactNodes = new uint[touchable.Length];
            contactVectors = new float[3 * touchable.Length];
            geometry = new RestGeometry(native, unitsPerMillimetre);
            playhead = new Playhead(step);
            clock = new FrameClock(step);
            now = 0.0;
            presents = solvesContact && surface.TryPresent(scene);
            ReadStats();
            filter.sharedMesh = surface.Mesh;
            BeginSupports();
        }

        private void ReadStats()
        {
            LastStats = scene.Stats();
            LastTiming = scene.Timing();
        }

        private void Close()
        {
            CloseCuts();
            if (scene != null) scene.Dispose();
            if (surface != null)
            {
                GetComponent<MeshFilter>().sharedMesh = shownBefore;
                surface.Dispose();
            }
            if (acquired && model != null) model.Release();
            scene = null;
            surface = null;
            shownBefore = null;
            geometry = null;
            contactCount = 0;
            readingCount = 0;
            submittedCount = 0;
            inFlight = false;
            refused = false;
            acquired = false;
        }

        private void Advance(float deltaTime)
        {
            if (presents)
            {
                Present(deltaTime);
                return;
            }
            playhead.Advance(deltaTime);
            if (inFlight) Collect();
            using (UploadMarker.Auto())
            {
                surface.Sample(scene, playhead.Alpha);
                // A step that finished after it was asked for has changed the two states under the sample.
                if (inFlight && scene.Stats().step_count != LastStats.step_count)
                {
                    Collect();
                    surface.Sample(scene, playhead.Alpha);
                }
                surface.Upload(recalculateNormals);
            }
            if (inFlight || !playhead.IsDue) return;
            using (ContactMarker.Auto()) Submit();
            inFlight = true;
            playhead.Submitted();
        }

        /// <summary>A frame at its own moment; the next step where it is due.</summary>
        private void Present(float deltaTime)
        {
            now += deltaTime;
            int count = TakePoses();
            clock.Moved(now, poses, count);
            LookAtSupports(deltaTime);
            if (inFlight) Collect();
            CatchUp();
            using (UploadMarker.Auto())
            {
                Show(count);
                // A step that finished after it was asked for has changed the state under the frame.
                if (inFlight && scene.Stats().step_count != LastStats.step_count)
                {
                    clock.Published();
                    Collect();
                    Show(count);
                }
                Upload();
            }
            if (inFlight || !clock.IsDue(now)) return;
            using (ContactMarker.Auto())
            {
                Operate();
                submittedCount = clock.Start(now, ref stepPoses);
                inFlight = true;
                TakePlaces();
                scene.Submit(OfStep());
            }
        }

        /// <summary>Makes the steps that are due before the last one, where frames come slower than steps and steps are
        /// quick.</summary>
        private void CatchUp()
        {
            for (int made = 0; made < MostMade && !inFlight && clock.IsBehind(now); made++)
            {
                if (LastTiming.step_ms > 500.0 * clock.Step) return;
                using (ContactMarker.Auto())
                {
                    Operate();
                    submittedCount = clock.Start(now, ref stepPoses);
                    TakePlaces();
                    try
                    {
                        scene.Step(OfStep(), null);
                    }
                    catch (UptException error)
                    {
                        if (!Refuse(error)) throw;
                        continue;
                    }
                    Take();
                }
            }
        }

        /// <summary>Takes the submitted step's result when it is there.</summary>
        private void Collect()
        {
            try
            {
                if (!scene.Poll()) return;
            }
            catch (UptException error)
            {
                if (!Refuse(error)) throw;
                return;
            }
            Take();
        }

        /// <summary>The step failed. False where the tissue cannot go on: for any reason but that the guard refused its
        /// state.</summary>
        private bool Refuse(UptException error)
        {
            inFlight = false;
            clock.Finished();
            if (error.Status != Native.UPT_ERR_GUARD) return false;
            Hold(error);
            return true;
        }

        /// <summary>The step has been made.</summary>
        private void Take()
        {
            inFlight = false;
            refused = false;
            clock.Finished();
            ReadStats();
            if (solvesContact)
            {
                scene.Readings(readings, submittedCount);
                readingCount = submittedCount;
                contactCount = scene.InstrumentContacts(ref pushes);
            }
            TakeBeds();
            StepCounters.Add(LastTiming);
            playhead.Landed();
        }

        /// <summary>The guard refused a state: the tissue stands still in its last good one and goes on from there.
        /// One line for a run of refusals.</summary>
        private void Hold(UptException error)
        {
            ReadStats();
            playhead.Refused();
            if (!refused) Debug.LogWarning("libupt: soft tissue '" + name + "' holds its last state: " + error.Message, this);
            refused = true;
        }

        /// <summary>Hands the instruments' poses to the worker. Each keeps its place of the list, by which the scene knows it:
        /// one that takes no part is far away.</summary>
        private void Submit()
        {
            int count = TakePoses();
            if (stepPoses.Length < count) stepPoses = new upt_instrument[2 * count];
            submittedCount = count;
            TakePlaces();
            if (solvesContact)
            {
                scene.Submit(StepInput.OfInstruments(poses, count));
                return;
            }
            contactCount = count == 0 ? 0 : scene.ContactsFrom(poses, count, contactNodes, contactVectors);
            scene.Submit(StepInput.OfContacts(contactNodes, contactVectors, contactCount));
        }

        /// <summary>Where the instruments are now; their number.</summary>
        private int TakePoses()
        {
            int count = instruments.Count;
            if (poses.Length < count) poses = new upt_instrument[2 * count];
            for (int i = 0; i < count; i++)
                poses[i] = TakesPart(i) ? instruments[i].PoseIn(transform, unitsPerMillimetre) : FarAway();
            return count;
        }

        /// <summary>Which instrument the readings of the submitted step will be of.</summary>
        private void TakePlaces()
        {
            if (places.Length < submittedCount)
            {
                places = new Instrument[2 * submittedCount];
                readings = new upt_instrument_reading[2 * submittedCount];
                readingCount = 0;
            }
            for (int i = 0; i < submittedCount; i++)
            {
                places[i] = TakesPart(i) ? instruments[i] : null;
                // The pose is of an earlier frame; a hull that it names may be gone.
                if (places[i] == null) stepPoses[i] = FarAway();
                else stepPoses[i].hull = poses[i].hull;
            }
        }

        private bool TakesPart(int index)
        {
            return index < instruments.Count && instruments[index] != null && instruments[index].isActiveAndEnabled &&
                   !IsInSlit(instruments[index]);
        }

        /// <summary>A small sphere that touches nothing.</summary>
        private static upt_instrument FarAway()
        {
            return Instruments.Sphere(1f).At(5000f, 0f, 0f);
        }

        /// <summary>Whether the bundle has a linear response to solve contact with. The scene is at rest after it.</summary>
        private static bool Solves(Scene scene)
        {
            try
            {
                scene.Step(StepInput.OfInstruments(new[] { FarAway() }, 1), null);
            }
            catch (UptException error)
            {
                if (error.Status != Native.UPT_ERR_UNSUPPORTED) throw;
                return false;
            }
            scene.Reset();
            return true;
        }

        private void Fail(string what, Exception error)
        {
            failed = true;
            Debug.LogError("libupt: soft tissue '" + name + "' " + what + ": " + error.Message, this);
        }
    }
}
