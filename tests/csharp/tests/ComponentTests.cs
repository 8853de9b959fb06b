using System;
using System.IO;
using NUnit.Framework;
using Unity.Profiling;
using Upt.Interop;
using Upt.Samples;
using UnityEngine;

namespace Upt.Tests
{
    /// <summary>The components' own logic, on a stub of the engine (tests/csharp/stub).</summary>
    [TestFixture]
    public sealed partial class ComponentTests
    {
        private static UptModel Asset(string path)
        {
            UptModel asset = ScriptableObject.CreateInstance<UptModel>();
            asset.bundlePath = Path.GetFullPath(path);
            asset.threads = 1;
            return asset;
        }

        /// <summary>An object whose components are still to be filled in.</summary>
        private static GameObject Inactive()
        {
            GameObject item = new GameObject("tissue");
            item.SetActive(false);
            return item;
        }

        /// <summary>A tissue on the test bundle, with a mesh filter, not yet enabled.</summary>
        private static SoftTissue Tissue()
        {
            GameObject item = Inactive();
            item.AddComponent<MeshFilter>();
            SoftTissue tissue = item.AddComponent<SoftTissue>();
            tissue.model = Asset(Bundle.Path);
            return tissue;
        }

        /// <summary>Frames of the sample and its tissue at 60 Hz of the stub's clock. A step that a frame submits has
        /// finished before the next one, however long it takes here.</summary>
        private static void Play(GameObject sample, SoftTissue tissue, int frames, Action<int> each)
        {
            for (int frame = 0; frame < frames; frame++)
            {
                sample.Send("Update");
                tissue.gameObject.Send("Update");
                each(frame);
                FinishStep(tissue);
            }
        }

        /// <summary>Waits for the step in flight. The component still polls it in its next frame.</summary>
        private static void FinishStep(SoftTissue tissue)
        {
            const System.Reflection.BindingFlags Own =
                System.Reflection.BindingFlags.Instance | System.Reflection.BindingFlags.NonPublic;
            bool inFlight = (bool)typeof(SoftTissue).GetField("inFlight", Own).GetValue(tissue);
            Scene scene = (Scene)typeof(SoftTissue).GetField("scene", Own).GetValue(tissue);
            if (inFlight) Assert.That(scene.Wait(uint.MaxValue), "a step of the fixture must succeed");
        }

        private static PushedBrain Sample()
        {
            PushedBrain sample = Inactive().AddComponent<PushedBrain>();
            sample.model = Asset(Bundle.Path);
            sample.gameObject.SetActive(true);
            return sample;
        }

        [SetUp]
        public void ForgetErrors()
        {
            Debug.Errors.Clear();
            Debug.Warnings.Clear();
        }

        [Test]
        public void PlayingTheSampleMovesTheBrainUnderTheSpatula()
        {
            PushedBrain sample = Sample();
            Assert.That(Debug.Errors, Is.Empty);
            SoftTissue tissue = sample.Tissue;
            Mesh mesh = tissue.GetComponent<MeshFilter>().sharedMesh;
            Vector3[] rest = mesh.vertices;
            int most = 0;
            Play(sample.gameObject, tissue, 150, frame => most = Math.Max(most, tissue.ContactCount));
            Assert.That(Debug.Errors, Is.Empty);
            Assert.That(most, Is.GreaterThan(0), "the spatula never touched the tissue");
            Assert.That(tissue.ContactPoints().Length, Is.EqualTo(tissue.ContactCount));
            float largest = 0f;
            for (int i = 0; i < rest.Length; i++) largest = Math.Max(largest, (mesh.Shown(i) - rest[i]).magnitude);
            Assert.That(largest, Is.GreaterThan(0.001f).And.LessThan(0.03f), "vertices moved by 1 to 30 mm");
            sample.gameObject.SetActive(false);
            Assert.That(tissue.IsRunning, Is.False);
            Assert.That(mesh.destroyed, "the tissue's mesh is left behind");
            Assert.That(tissue.GetComponent<MeshFilter>().sharedMesh, Is.Null);
        }

        [Test]
        public void ThePressedSpatulaIsPushedBack()
        {
            PushedBrain sample = Sample();
            SoftTissue tissue = sample.Tissue;
            if (!tissue.SolvesContact) Assert.Ignore("the test bundle has no linear response");
            Instrument spatula = tissue.instruments[0];
            InstrumentReading reading;
            Assert.That(tissue.TryGetReading(spatula, out reading), Is.False, "no step has been made");
            float largest = 0f, outward = 0f, deepest = 0f;
            Play(sample.gameObject, tissue, 120, frame =>
            {
                if (!tissue.TryGetReading(spatula, out reading) || reading.force.magnitude <= largest) return;
                largest = reading.force.magnitude;
                // The sample's spatula looks out of the tissue.
                outward = Vector3.Dot(reading.force, spatula.transform.rotation * new Vector3(0f, 0f, 1f));
                deepest = reading.penetration;
                Assert.That(reading.contactCount, Is.EqualTo(tissue.ContactCount));
            });
            Assert.That(Debug.Errors, Is.Empty);
            Assert.That(largest, Is.GreaterThan(1f), "mN");
            Assert.That(outward, Is.GreaterThan(0.7f * largest));
            Assert.That(deepest, Is.LessThan(1f));
            spatula.gameObject.SetActive(false);
            Play(sample.gameObject, tissue, 12, frame => { });
            Assert.That(tissue.TryGetReading(spatula, out reading), Is.False, "it takes no part");
            Assert.That(tissue.ContactCount, Is.EqualTo(0));
            sample.gameObject.SetActive(false);
        }

        [Test]
        public void TheHullOfACollidersMeshPushesAsTheBoxOfItsSize()
        {
            float[] forces = new float[2];
            for (int turn = 0; turn < 2; turn++)
            {
                PushedBrain sample = Sample();
                SoftTissue tissue = sample.Tissue;
                if (!tissue.SolvesContact) Assert.Ignore("the test bundle has no linear response");
                Instrument tool = tissue.instruments[0];
                tool.shape = turn == 0 ? InstrumentShape.Box : InstrumentShape.Hull;
                Vector3 half = tool.halfExtents * 0.001f;
                Mesh mesh = new Mesh();
                Vector3[] corners = new Vector3[8];
                for (int i = 0; i < 8; i++)
                    corners[i] = new Vector3((i & 1) != 0 ? half.x : -half.x, (i & 2) != 0 ? half.y : -half.y,
                                             (i & 4) != 0 ? half.z : -half.z);
                mesh.vertices = corners;
                tool.hull = tool.gameObject.AddComponent<MeshCollider>();
                tool.hull.sharedMesh = mesh;
                tool.hull.gameObject = tool.gameObject;
                InstrumentReading reading = default(InstrumentReading);
                Play(sample.gameObject, tissue, 100, frame =>
                {
                    InstrumentReading now;
                    if (tissue.TryGetReading(tool, out now)) reading = now;
                });
                Assert.That(Debug.Errors, Is.Empty);
                forces[turn] = reading.force.magnitude;
                sample.gameObject.SetActive(false);
            }
            Assert.That(forces[0], Is.GreaterThan(1f));
            Assert.That(forces[1], Is.EqualTo(forces[0]).Within(0.05f * forces[0]));
        }

        [Test]
        public void AHullWithoutAMeshIsOneConsoleErrorThatSaysWhatToAssign()
        {
            PushedBrain sample = Sample();
            sample.Tissue.instruments[0].shape = InstrumentShape.Hull;
            Play(sample.gameObject, sample.Tissue, 6, frame => { });
            Assert.That(Debug.Errors.Count, Is.EqualTo(1));
            Assert.That(Debug.Errors[0], Is.StringContaining("'Hull'"));
            sample.gameObject.SetActive(false);
        }

        [Test]
        public void AMissingBundleIsOneConsoleErrorAndTheEditorLives()
        {
            SoftTissue tissue = Tissue();
            tissue.model = Asset("/no/such/bundle");
            tissue.gameObject.SetActive(true);
            tissue.gameObject.Send("Update");
            tissue.gameObject.SetActive(false);
            Assert.That(Debug.Errors.Count, Is.EqualTo(1));
            Assert.That(Debug.Errors[0], Is.StringContaining("/no/such/bundle"));
        }

        [Test]
        public void AMeshOutsideTheBrainIsOneConsoleError()
        {
            SoftTissue tissue = Tissue();
            tissue.renderMesh = new Mesh();
            tissue.renderMesh.vertices = new[] { new Vector3(9f, 9f, 9f) };
            tissue.gameObject.SetActive(true);
            Assert.That(tissue.IsRunning, Is.False);
            Assert.That(Debug.Errors.Count, Is.EqualTo(1), string.Join("; ", Debug.Errors.ToArray()));
            Assert.That(Debug.Errors[0], Is.StringContaining("point 0"));
            tissue.gameObject.SetActive(false);
        }

        [Test]
        public void AMeshThatScriptsCannotReadIsOneConsoleErrorThatSaysWhatToTurnOn()
        {
            SoftTissue tissue = Tissue();
            tissue.renderMesh = new Mesh();
            tissue.renderMesh.vertices = new[] { new Vector3(0f, 0f, 0f) };
            tissue.renderMesh.isReadable = false;
            tissue.gameObject.SetActive(true);
            Assert.That(Debug.Errors.Count, Is.EqualTo(1));
            Assert.That(Debug.Errors[0], Is.StringContaining("Read/Write"));
            tissue.gameObject.SetActive(false);
        }

        [Test]
        public void AMeshOfTheFiltersKeepsItsOtherVertexData()
        {
            SoftTissue bare = Tissue();
            bare.gameObject.SetActive(true);
            Vector3[] vertices = bare.GetComponent<MeshFilter>().sharedMesh.vertices;
            bare.gameObject.SetActive(false);

            Mesh own = new Mesh();
            own.vertices = vertices;
            PushedBrain sample = Inactive().AddComponent<PushedBrain>();
            sample.model = Asset(Bundle.Path);
            sample.gameObject.SetActive(true);
            SoftTissue tissue = sample.Tissue;
            tissue.gameObject.SetActive(false);
            tissue.GetComponent<MeshFilter>().sharedMesh = own;
            tissue.gameObject.SetActive(true);
            Assert.That(Debug.Errors, Is.Empty);
            Mesh shown = tissue.GetComponent<MeshFilter>().sharedMesh;
            Assert.That(shown, Is.Not.SameAs(own), "an asset must not be deformed");
            Play(sample.gameObject, tissue, 120, frame => { });
            float largest = 0f;
            for (int i = 0; i < vertices.Length; i++)
            {
                largest = Math.Max(largest, (shown.Shown(i) - vertices[i]).magnitude);
                for (int b = 12; b < Mesh.Interleaved; b++)
                    if (shown.stream[Mesh.Interleaved * i + b] != own.stream[Mesh.Interleaved * i + b])
                        Assert.Fail("byte " + b + " of vertex " + i + " is not a position and was changed");
                Assert.That((own.Shown(i) - vertices[i]).magnitude, Is.EqualTo(0f));
            }
            Assert.That(largest, Is.GreaterThan(0.001f), "the mesh did not move");
            sample.gameObject.SetActive(false);
            Assert.That(tissue.GetComponent<MeshFilter>().sharedMesh, Is.SameAs(own));
        }

        [Test]
        public void AMirroredTissueIsSaidOnce()
        {
            foreach (float scale in new[] { 1f, -1f })
            {
                SoftTissue tissue = Tissue();
                tissue.transform.localScale = new Vector3(scale, 1f, 1f);
                Debug.Warnings.Clear();
                tissue.gameObject.SetActive(true);
                tissue.gameObject.Send("Update");
                tissue.gameObject.SetActive(false);
                Assert.That(Debug.Errors, Is.Empty);
                Assert.That(Debug.Warnings.Count, Is.EqualTo(scale < 0f ? 1 : 0));
                if (scale < 0f) Assert.That(Debug.Warnings[0], Is.StringContaining("mirrored"));
            }
        }

        [Test]
        public void ComponentDestroyedInFlight()
        {
            for (int i = 0; i < 10; i++)
            {
                SoftTissue tissue = Tissue();
                tissue.gameObject.SetActive(true);
                Time.deltaTime = 0.06f;
                tissue.gameObject.Send("Update");
                tissue.gameObject.SetActive(false);
                Time.deltaTime = 1f / 60f;
            }
            Assert.That(Debug.Errors, Is.Empty);
        }

        [Test]
        public void FinishedStepsAreCountedInTheProfiler()
        {
            PushedBrain sample = Sample();
            GameObject item = sample.gameObject;
            long before = StepsCounted();
            double told = 0.0;
            ulong last = 0;
            for (int frame = 0; frame < 60; frame++)
            {
                item.Send("Update");
                sample.Tissue.gameObject.Send("Update");
                FinishStep(sample.Tissue);
                if (sample.Tissue.LastStats.step_count == last) continue;
                last = sample.Tissue.LastStats.step_count;
                told += sample.Tissue.LastTiming.step_ms;
            }
            item.SetActive(false);
            Assert.That(told, Is.GreaterThan(0.0));
            Assert.That(1e-6 * (StepsCounted() - before), Is.EqualTo(told).Within(1e-3 * told));
            // A step in contact is made by the learned part or, where the bundle recommends it, by corrections.
            Assert.That(StubCounters.Read("libupt Prior"), Is.GreaterThan(0));
            Assert.That(
                StubCounters.Read("libupt Latent") + StubCounters.Read("libupt Corrections"), Is.GreaterThan(0));
        }

        private static long StepsCounted()
        {
            return StubCounters.Cells.ContainsKey("libupt Step") ? StubCounters.Read("libupt Step") : 0;
        }

        [Test]
        public void CorrectionsOfTheInspectorReachTheSteps()
        {
            PushedBrain sample = Sample();
            SoftTissue tissue = sample.Tissue;
            if (!tissue.Presents) Assert.Ignore("the test bundle has no corrections");
            foreach (int most in new[] { 2, 3, -1 })
            {
                tissue.gameObject.SetActive(false);
                tissue.corrections = most;
                tissue.gameObject.SetActive(true);
                Assert.That(Debug.Errors, Is.Empty);
                Assert.That(tissue.Presents, Is.EqualTo(most > 0));
                uint made = 0;
                Play(sample.gameObject, tissue, 60, frame => made = Math.Max(made, tissue.LastStats.corrections));
                Assert.That(made, Is.EqualTo((uint)Math.Max(most, 0)));
            }
            // A target far above any error: the least that a target leaves.
            tissue.gameObject.SetActive(false);
            tissue.corrections = 20;
            tissue.correctionsTarget = 100f;
            tissue.gameObject.SetActive(true);
            uint few = 0;
            Play(sample.gameObject, tissue, 60, frame => few = Math.Max(few, tissue.LastStats.corrections));
            Assert.That(few, Is.GreaterThan(0).And.LessThan(20));
        }

        [Test]
        public void DampingOfTheInspectorReachesTheTissue()
        {
            PushedBrain sample = Sample();
            SoftTissue tissue = sample.Tissue;
            if (!tissue.Presents) Assert.Ignore("the test bundle has no corrections");
            tissue.gameObject.SetActive(false);
            tissue.damping = 2000f;
            tissue.gameObject.SetActive(true);
            Assert.That(tissue.IsRunning, Is.False);
            Assert.That(Debug.Errors, Has.Count.EqualTo(1));
            Assert.That(Debug.Errors[0], Is.StringContaining("damping_per_s"));
            Debug.Errors.Clear();
            tissue.gameObject.SetActive(false);
            tissue.damping = 2f;
            tissue.gameObject.SetActive(true);
            Assert.That(Debug.Errors, Is.Empty);
            uint made = 0;
            Play(sample.gameObject, tissue, 60, frame => made = Math.Max(made, tissue.LastStats.evaluations));
            Assert.That(made, Is.GreaterThan(0));
        }

        [Test]
        public void SubstepsOfTheInspectorNeedATarget()
        {
            SoftTissue tissue = Tissue();
            tissue.corrections = 3;
            tissue.substeps = 4;
            tissue.gameObject.SetActive(true);
            Assert.That(tissue.IsRunning, Is.False);
            Assert.That(Debug.Errors, Has.Count.EqualTo(1));
            Assert.That(Debug.Errors[0], Is.StringContaining("substeps"));
        }

        [Test]
        public void CorrectionsThatCannotBeStopTheTissueWithAMessage()
        {
            SoftTissue tissue = Tissue();
            tissue.corrections = 0;
            tissue.correctionsTarget = 0.1f;
            tissue.gameObject.SetActive(true);
            Assert.That(tissue.IsRunning, Is.False);
            Assert.That(Debug.Errors, Has.Count.EqualTo(1));
            Assert.That(Debug.Errors[0], Is.StringContaining("corrections.target_mm"));
        }
    }
}
