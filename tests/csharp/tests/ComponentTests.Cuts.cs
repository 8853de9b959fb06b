using System;
using System.Collections.Generic;
using System.IO;
using NUnit.Framework;
using Upt.Interop;
using Upt.Samples;
using UnityEngine;

namespace Upt.Tests
{
    // Cutters and supports on the corrected phantom: a box that is held at its lower side.
    public sealed partial class ComponentTests
    {
        /// <summary>A tissue on the phantom; not yet enabled.</summary>
        private static SoftTissue Phantom(string bundle)
        {
            SoftTissue tissue = Tissue();
            tissue.gameObject.AddComponent<MeshRenderer>().sharedMaterial = new Material(null);
            tissue.model = Asset(bundle);
            tissue.corrections = 5;
            return tissue;
        }

        private static string Corrected
        {
            get { return Environment.GetEnvironmentVariable("UPT_TEST_CORRECTED"); }
        }

        /// <summary>Box of the tissue's vertices, in its own space.</summary>
        private static void Extent(SoftTissue tissue, out Vector3 low, out Vector3 high)
        {
            Vector3[] all = tissue.GetComponent<MeshFilter>().sharedMesh.vertices;
            low = high = all[0];
            foreach (Vector3 v in all)
            {
                low = new Vector3(Math.Min(low.x, v.x), Math.Min(low.y, v.y), Math.Min(low.z, v.z));
                high = new Vector3(Math.Max(high.x, v.x), Math.Max(high.y, v.y), Math.Max(high.z, v.z));
            }
        }

        private static void Frames(SoftTissue tissue, int count, Action<int> each)
        {
            for (int frame = 0; frame < count; frame++)
            {
                each(frame);
                tissue.gameObject.Send("Update");
                FinishStep(tissue);
            }
        }

        private static Scene SceneOf(SoftTissue tissue)
        {
            return (Scene)typeof(SoftTissue)
                .GetField("scene", System.Reflection.BindingFlags.Instance | System.Reflection.BindingFlags.NonPublic)
                .GetValue(tissue);
        }

        private static T Tool<T>(SoftTissue tissue) where T : Cutter, new()
        {
            T tool = new GameObject(typeof(T).Name).AddComponent<T>();
            tissue.cutters.Add(tool);
            return tool;
        }

        /// <summary>Each edge of the triangles of both submeshes is passed as often in one direction as in the other.</summary>
        private static void AssertClosed(Mesh mesh)
        {
            Dictionary<long, int> edges = new Dictionary<long, int>();
            for (int part = 0; part < mesh.subMeshCount; part++)
            {
                int[] corners = mesh.GetTriangles(part);
                for (int i = 0; i < corners.Length; i++)
                {
                    long a = corners[i], b = corners[i % 3 == 2 ? i - 2 : i + 1];
                    long edge = Math.Min(a, b) << 32 | Math.Max(a, b);
                    int before;
                    edges.TryGetValue(edge, out before);
                    edges[edge] = before + (a < b ? 1 : -1);
                }
            }
            foreach (int times in edges.Values) Assert.That(times, Is.EqualTo(0), "the surface is open");
        }

        [Test]
        public void AScalpelOpensTheTissueAndUndoHealsIt()
        {
            SoftTissue tissue = Phantom(Corrected);
            Scalpel scalpel = Tool<Scalpel>(tissue);
            scalpel.active = false;
            scalpel.fractureEnergy = 10f;
            tissue.insideMaterial = new Material(null);
            tissue.gameObject.SetActive(true);
            Assert.That(Debug.Errors, Is.Empty);
            Mesh whole = tissue.GetComponent<MeshFilter>().sharedMesh;
            Vector3 low, high;
            Extent(tissue, out low, out high);
            Frames(tissue, 4, frame => { });
            Assert.That(tissue.IsCut, Is.False);
            // Upright, the edge from 12 mm below the upper side upward, along x through the middle.
            float z = 0.5f * (low.z + high.z);
            scalpel.active = true;
            float felt = 0f;
            Frames(tissue, 60, frame =>
            {
                float x = low.x - 0.003f + (high.x - low.x) * frame / 110f;
                scalpel.transform.position = new Vector3(x, high.y - 0.012f, z);
                felt = Math.Max(felt, scalpel.Force.magnitude);
            });
            Assert.That(Debug.Errors, Is.Empty);
            Assert.That(Debug.Warnings, Is.Empty);
            Assert.That(tissue.IsCut && scalpel.IsWorking);
            Assert.That(scalpel.CutArea, Is.GreaterThan(150f));
            Assert.That(felt, Is.GreaterThan(10f), "mN: 10 J/m2 times some millimetres of edge");
            Mesh shown = tissue.GetComponent<MeshFilter>().sharedMesh;
            Assert.That(shown, Is.Not.SameAs(whole));
            Assert.That(shown.subMeshCount, Is.EqualTo(2));
            Assert.That(shown.GetTriangles(1).Length, Is.GreaterThan(9));
            AssertClosed(shown);
            Assert.That(tissue.GetComponent<MeshRenderer>().sharedMaterials[1], Is.SameAs(tissue.insideMaterial));
            // At rest again the organ is where it was: its extent is that of the mesh.
            scalpel.active = false;
            Frames(tissue, 90, frame => { });
            Assert.That(shown.Shown(0).x, Is.InRange(low.x - 0.003f, high.x + 0.003f));

            Assert.That(tissue.UndoCount, Is.EqualTo(1));
            Assert.That(tissue.Undo());
            Assert.That(tissue.Undo(), Is.False);
            Frames(tissue, 3, frame => { });
            Assert.That(shown.GetTriangles(1).Length, Is.EqualTo(0));
            AssertClosed(shown);
            // Undone in the middle of a stroke the scalpel waits until it has been off.
            Action<int> cut = frame =>
            {
                float x = low.x - 0.003f + (high.x - low.x) * frame / 110f;
                scalpel.transform.position = new Vector3(x, high.y - 0.012f, z);
            };
            scalpel.active = true;
            Frames(tissue, 30, cut);
            Assert.That(shown.GetTriangles(1).Length, Is.GreaterThan(0), "a second cut");
            Assert.That(tissue.Undo());
            Frames(tissue, 30, frame => cut(30 + frame));
            Assert.That(shown.GetTriangles(1).Length, Is.EqualTo(0), "at work when it was undone");
            scalpel.active = false;
            Frames(tissue, 6, frame => { });
            scalpel.active = true;
            Frames(tissue, 30, frame => cut(30 + frame));
            Assert.That(shown.GetTriangles(1).Length, Is.GreaterThan(0), "off and on again");
            scalpel.active = false;
            tissue.ResetTissue();
            Frames(tissue, 3, frame => { });
            Assert.That(tissue.GetComponent<MeshFilter>().sharedMesh, Is.SameAs(whole));
            Assert.That(tissue.GetComponent<MeshRenderer>().sharedMaterials.Length, Is.EqualTo(1));
            Assert.That(Debug.Errors, Is.Empty);
            tissue.gameObject.SetActive(false);
        }

        [Test]
        public void AScalpelPressesUntilItIsPushedHardEnough()
        {
            SoftTissue tissue = Phantom(Corrected);
            Scalpel scalpel = Tool<Scalpel>(tissue);
            Instrument body = scalpel.gameObject.AddComponent<Instrument>();
            body.shape = InstrumentShape.Capsule;
            body.halfExtents = new Vector3(0f, 6f, 0f);
            body.radius = 1f;
            tissue.instruments.Add(body);
            scalpel.body = body;
            scalpel.length = 12f;
            scalpel.threshold = 15f;
            scalpel.oneEdged = true;
            tissue.gameObject.SetActive(true);
            Vector3 low, high;
            Extent(tissue, out low, out high);
            // It lies along x and goes down: its z axis points into the tissue.
            scalpel.transform.rotation = new Quaternion(0.5f, 0.5f, -0.5f, 0.5f);
            Vector3 along = scalpel.transform.rotation * Vector3.up;
            Assert.That(along.x, Is.GreaterThan(0.99f));
            Assert.That((scalpel.transform.rotation * new Vector3(0f, 0f, 1f)).y, Is.LessThan(-0.99f));
            Vector3 middle = (low + high) * 0.5f - along * 0.006f;
            float pressed = 0f;
            int cutAt = -1;
            Frames(tissue, 90, frame =>
            {
                scalpel.transform.position = new Vector3(middle.x, high.y + 0.002f - 0.0002f * frame, middle.z);
                InstrumentReading reading;
                if (cutAt < 0 && tissue.TryGetReading(body, out reading)) pressed = Math.Max(pressed, reading.force.magnitude);
                if (cutAt < 0 && scalpel.CutArea > 0f) cutAt = frame;
            });
            Assert.That(Debug.Errors, Is.Empty);
            Assert.That(cutAt, Is.GreaterThan(10), "it has cut before it touched");
            Assert.That(pressed, Is.GreaterThanOrEqualTo(14f), "mN, by which it was pushed before it cut");
            tissue.gameObject.SetActive(false);
        }

        [Test]
        public void ScissorsCloseAndAnAspiratorTakes()
        {
            SoftTissue tissue = Phantom(Corrected);
            Scissors scissors = Tool<Scissors>(tissue);
            Aspirator aspirator = Tool<Aspirator>(tissue);
            aspirator.active = false;
            tissue.gameObject.SetActive(true);
            Vector3 low, high;
            Extent(tissue, out low, out high);
            // From above, the jaws down into the tissue.
            scissors.transform.rotation = Quaternion.AngleAxis(180f, new Vector3(1f, 0f, 0f));
            scissors.transform.position = new Vector3(0.45f * low.x + 0.55f * high.x, high.y + 0.004f, 0.5f * (low.z + high.z));
            Frames(tissue, 40, frame => scissors.opening = 40f - frame);
            Assert.That(Debug.Errors, Is.Empty);
            Assert.That(Debug.Warnings, Is.Empty);
            // A triangle of 20 mm at 40 degrees, but for what lies outside of the tissue.
            Assert.That(scissors.CutArea, Is.InRange(70f, 145f));
            float cut = scissors.CutArea;
            Frames(tissue, 10, frame => scissors.opening = frame);
            Assert.That(scissors.CutArea, Is.EqualTo(cut), "what opens does not cut");
            scissors.active = false;
            aspirator.transform.position = new Vector3(0.5f * (low.x + high.x), high.y - 0.004f, 0.5f * (low.z + high.z));
            aspirator.active = true;
            Frames(tissue, 30, frame => { });
            Assert.That(aspirator.RemovedVolume, Is.InRange(30f, 4.19f * 64f));
            AssertClosed(tissue.GetComponent<MeshFilter>().sharedMesh);
            Assert.That(tissue.UndoCount, Is.EqualTo(2));
            Assert.That(Debug.Errors, Is.Empty);
            tissue.gameObject.SetActive(false);
        }

        [Test]
        public void ASupportLeadsItsGroupAndThatOfACutBody()
        {
            string folder = SupportGroupTests.BundleWithGroup();
            try
            {
                SoftTissue tissue = Phantom(folder);
                Support support = new GameObject("support").AddComponent<Support>();
                support.transform.position = new Vector3(0.02f, 0f, 0.03f);
                tissue.supports.Add(support);
                uint[] held;
                using (Model model = new Model(folder, 1)) held = model.SupportNodes(0);
                tissue.gameObject.SetActive(true);
                Scene scene = SceneOf(tissue);
                float[] rest = new float[3 * held.Length], moved = new float[3 * held.Length];
                using (Model model = new Model(folder, 1))
                {
                    float[] all = model.Positions();
                    for (int i = 0; i < rest.Length; i++) rest[i] = all[3 * held[i / 3] + i % 3];
                }
                Frames(tissue, 5, frame => { });
                // 2 mm up, and a tenth of a radian about Unity's y, which is the bundle's z.
                Quaternion turn = Quaternion.AngleAxis(5.7f, Vector3.up);
                Frames(tissue, 40, frame =>
                {
                    float part = Math.Min(1f, frame / 30f);
                    support.transform.position = new Vector3(0.02f, 0.002f * part, 0.03f);
                    support.transform.rotation = Quaternion.AngleAxis(5.7f * part, Vector3.up);
                });
                Assert.That(Debug.Errors, Is.Empty);
                scene.Decode(held, moved);
                for (int i = 0; i < held.Length; i++)
                {
                    Vector3 x = Anatomical.ToUnity(rest[3 * i], rest[3 * i + 1], rest[3 * i + 2], 0.001f);
                    Vector3 start = new Vector3(0.02f, 0f, 0.03f);
                    Vector3 wanted = turn * (x - start) + start + new Vector3(0f, 0.002f, 0f) - x;
                    Vector3 found = Anatomical.ToUnity(moved[3 * i], moved[3 * i + 1], moved[3 * i + 2], 0.001f);
                    Assert.That((found - wanted).magnitude, Is.LessThan(2e-5f), "node " + held[i] + ", metres");
                }
                Scalpel scalpel = Tool<Scalpel>(tissue);
                Vector3 low, high;
                Extent(tissue, out low, out high);
                Action<int> cuts = frame =>
                    scalpel.transform.position = new Vector3(low.x + 0.001f * frame, high.y - 0.012f, 0.5f * (low.z + high.z));
                Frames(tissue, 40, cuts);
                string said = string.Join("; ", Debug.Warnings.ToArray()) + string.Join("; ", Debug.Errors.ToArray());
                Assert.That(scalpel.CutArea, Is.GreaterThan(100f), said);
                scalpel.active = false;
                support.transform.position = new Vector3(0.02f, 0.004f, 0.03f);
                Frames(tissue, 20, frame => { });
                Assert.That(tissue.IsRunning && Debug.Errors.Count == 0, said);
                Assert.That(Debug.Warnings, Is.Empty);
                scene.Decode(held, moved);
                for (int i = 0; i < held.Length; i++) Assert.That(moved[3 * i + 2], Is.EqualTo(4f).Within(0.02f), "node " + held[i]);
                tissue.ResetTissue();
                Frames(tissue, 5, frame => { });
                Assert.That(tissue.IsRunning && Debug.Errors.Count == 0);
                tissue.gameObject.SetActive(false);
            }
            finally { Directory.Delete(folder, true); }
        }

        [Test]
        public void TheSampleCutsTheBrainAndHealsIt()
        {
            CutBrain sample = Inactive().AddComponent<CutBrain>();
            sample.model = Asset(Bundle.Path);
            sample.period = 3f;
            sample.gameObject.SetActive(true);
            if (!sample.Tissue.Presents) Assert.Ignore("the test bundle has no corrections");
            float area = 0f;
            int most = 0, healed = 0;
            Play(sample.gameObject, sample.Tissue, 200, frame =>
            {
                area = Math.Max(area, sample.Scalpel.CutArea);
                if (sample.Tissue.UndoCount < most) healed++;
                most = Math.Max(most, sample.Tissue.UndoCount);
            });
            Assert.That(Debug.Errors, Is.Empty);
            Assert.That(Debug.Warnings, Is.Empty);
            Assert.That(area, Is.GreaterThan(60f), "mm2");
            Assert.That(most, Is.EqualTo(1));
            Assert.That(healed, Is.GreaterThan(0));
            sample.gameObject.SetActive(false);
        }

        [Test]
        public void TheSampleHangsAGallBladderOnALiverThatBreathes()
        {
            BreathingLiver sample = Inactive().AddComponent<BreathingLiver>();
            sample.model = Asset(Corrected);
            sample.period = 1f;
            sample.drawnAfter = 1f;
            sample.speed = 30f;
            sample.gameObject.SetActive(true);
            float most = 0f, height = 0f;
            int torn = 0;
            Play(sample.gameObject, sample.Tissue, 250, frame =>
            {
                most = Math.Max(most, sample.Bed.Force.magnitude);
                height = Math.Max(height, sample.Tissue.transform.position.y);
                Assert.That(sample.Bed.Torn, Is.GreaterThanOrEqualTo(torn), "a torn tie holds again");
                torn = sample.Bed.Torn;
                if (frame < 40) Assert.That(torn, Is.EqualTo(0), "the bed tears while the organ breathes");
            });
            Assert.That(Debug.Errors, Is.Empty);
            Assert.That(height, Is.EqualTo(0.015f).Within(1e-3f));
            Assert.That(most, Is.InRange(50f, 1000f), "mN");
            Assert.That(sample.Bed.Count, Is.GreaterThan(3));
            Assert.That(torn, Is.EqualTo(sample.Bed.Count));
            sample.Bed.hangs = new GameObject("elsewhere").AddComponent<Instrument>();
            sample.Tissue.ResetTissue();
            Assert.That(Debug.Errors.Count, Is.EqualTo(1));
            Assert.That(Debug.Errors[0], Is.StringContaining("elsewhere"));
            sample.gameObject.SetActive(false);
        }

        [Test]
        public void ATissueThatCannotBeCutSaysSoOnceAndGoesOn()
        {
            SoftTissue tissue = Phantom(Corrected);
            Scalpel scalpel = Tool<Scalpel>(tissue);
            Support support = new GameObject("support").AddComponent<Support>();
            tissue.supports.Add(support);
            support.group = 7;
            tissue.gameObject.SetActive(true);
            Frames(tissue, 3, frame => { });
            Assert.That(Debug.Errors.Count, Is.EqualTo(1), "the phantom has no such group");
            Assert.That(Debug.Errors[0], Is.StringContaining("group 7"));
            Assert.That(scalpel.CutArea, Is.EqualTo(0f));
            tissue.gameObject.SetActive(false);
        }
    }
}
