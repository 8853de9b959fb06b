using System;
using System.IO;
using System.Threading;
using NUnit.Framework;
using Unity.Profiling;
using Upt.Interop;
using Upt.Samples;
using UnityEngine;

namespace Upt.Tests
{
    /// <summary>The components' own logic, on a stub of the engine (tests/csharp/stub).</summary>
    [TestFixture]
    public sealed class ComponentTests
    {
        private static UptModel Asset(string path)
        {
            UptModel asset = ScriptableObject.CreateInstance<UptModel>();
            asset.bundlePath = Path.GetFullPath(path);
            asset.threads = 1;
            return asset;
        }

        [SetUp]
        public void ForgetErrors()
        {
            Debug.Errors.Clear();
        }

        [Test]
        public void PlayingTheSampleMovesTheBrainUnderTheSpatula()
        {
            GameObject item = new GameObject("sample");
            PushedBrain sample = item.AddComponent<PushedBrain>();
            sample.model = Asset(Bundle.Path);
            item.SetActive(true);
            Assert.That(Debug.Errors, Is.Empty);
            SoftTissue tissue = sample.Tissue;
            Mesh mesh = tissue.GetComponent<MeshFilter>().sharedMesh;
            byte[] rest = (byte[])mesh.uploaded.Clone();
            int most = 0;
            for (int frame = 0; frame < 150; frame++)
            {
                item.Send("Update");
                tissue.gameObject.Send("Update");
                most = Math.Max(most, tissue.ContactCount);
                Thread.Sleep(2);
            }
            Assert.That(Debug.Errors, Is.Empty);
            Assert.That(most, Is.GreaterThan(0), "the spatula never touched the tissue");
            float largest = 0f;
            for (int i = 0; i < rest.Length; i += 4)
                largest = Math.Max(largest, Math.Abs(BitConverter.ToSingle(mesh.uploaded, i) -
                                                     BitConverter.ToSingle(rest, i)));
            Assert.That(largest, Is.GreaterThan(0.001f).And.LessThan(0.03f), "vertices moved by 1 to 30 mm");
            item.SetActive(false);
            Assert.That(tissue.IsRunning, Is.False);
        }

        [Test]
        public void AMissingBundleIsOneConsoleErrorAndTheEditorLives()
        {
            GameObject item = new GameObject("tissue");
            item.AddComponent<MeshFilter>();
            SoftTissue tissue = item.AddComponent<SoftTissue>();
            tissue.model = Asset("/no/such/bundle");
            item.SetActive(true);
            item.Send("Update");
            item.SetActive(false);
            Assert.That(Debug.Errors.Count, Is.EqualTo(1));
            Assert.That(Debug.Errors[0], Is.StringContaining("/no/such/bundle"));
        }

        [Test]
        public void AMeshOutsideTheBrainIsOneConsoleError()
        {
            GameObject item = new GameObject("tissue");
            item.AddComponent<MeshFilter>();
            SoftTissue tissue = item.AddComponent<SoftTissue>();
            tissue.model = Asset(Bundle.Path);
            tissue.renderMesh = new Mesh();
            tissue.renderMesh.vertices = new[] { new Vector3(9f, 9f, 9f) };
            item.SetActive(true);
            Assert.That(tissue.IsRunning, Is.False);
            Assert.That(Debug.Errors.Count, Is.EqualTo(1), string.Join("; ", Debug.Errors.ToArray()));
            item.SetActive(false);
        }

        [Test]
        public void ComponentDestroyedInFlight()
        {
            UptModel asset = Asset(Bundle.Path);
            for (int i = 0; i < 10; i++)
            {
                GameObject item = new GameObject("tissue");
                item.AddComponent<MeshFilter>();
                SoftTissue tissue = item.AddComponent<SoftTissue>();
                tissue.model = asset;
                item.SetActive(true);
                Time.deltaTime = 0.06f;
                item.Send("Update");
                item.SetActive(false);
                Time.deltaTime = 1f / 60f;
            }
            Assert.That(Debug.Errors, Is.Empty);
        }

        [Test]
        public void FinishedStepsAreCountedInTheProfiler()
        {
            GameObject item = new GameObject("sample");
            PushedBrain sample = item.AddComponent<PushedBrain>();
            sample.model = Asset(Bundle.Path);
            item.SetActive(true);
            long before = StepsCounted();
            double told = 0.0;
            ulong last = 0;
            for (int frame = 0; frame < 60; frame++)
            {
                item.Send("Update");
                sample.Tissue.gameObject.Send("Update");
                Thread.Sleep(2);
                if (sample.Tissue.LastStats.step_count == last) continue;
                last = sample.Tissue.LastStats.step_count;
                told += sample.Tissue.LastStats.step_ms;
            }
            item.SetActive(false);
            Assert.That(told, Is.GreaterThan(0.0));
            Assert.That(1e-6 * (StepsCounted() - before), Is.EqualTo(told).Within(1e-3 * told));
            Assert.That(StubCounters.Read("libupt Decode"), Is.GreaterThan(0));
            Assert.That(StubCounters.Read("libupt Latent"), Is.GreaterThan(0));
        }

        private static long StepsCounted()
        {
            return StubCounters.Cells.ContainsKey("libupt Step") ? StubCounters.Read("libupt Step") : 0;
        }

        [Test]
        public void FramesMakeNoGarbage()
        {
            GameObject item = new GameObject("sample");
            PushedBrain sample = item.AddComponent<PushedBrain>();
            sample.model = Asset(Bundle.Path);
            item.SetActive(true);
            SoftTissue tissue = sample.Tissue;
            System.Reflection.MethodInfo update = typeof(SoftTissue).GetMethod(
                "Update", System.Reflection.BindingFlags.Instance | System.Reflection.BindingFlags.NonPublic);
            Action frame = (Action)Delegate.CreateDelegate(typeof(Action), tissue, update);
            for (int i = 0; i < 60; i++) frame();
            int since = GC.CollectionCount(0);
            long before = GC.GetTotalMemory(true);
            since = GC.CollectionCount(0);
            for (int i = 0; i < 600; i++) frame();
            long after = GC.GetTotalMemory(false);
            Console.WriteLine("managed bytes over 600 frames: " + (after - before));
            Assert.That(GC.CollectionCount(0), Is.EqualTo(since));
            Assert.That(after - before, Is.LessThan(64 * 1024));
            item.SetActive(false);
        }
    }
}
