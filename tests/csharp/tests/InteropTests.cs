using System;
using System.IO;
using System.Threading;
using NUnit.Framework;
using Upt.Interop;

namespace Upt.Tests
{
    [TestFixture]
    public sealed class InteropTests
    {
        /// <summary>Every third domain node within a 15 mm ball of the first, pushed along -x by up to
        /// 8 mm: the same contact as tests/csharp/host.c.</summary>
        private static int Push(Model model, int step, uint[] nodes, float[] vectors)
        {
            uint[] domain = model.Indices(Native.UPT_SET_DOMAIN_NODES);
            float[] positions = model.Positions();
            float depth = step <= 40 ? 0.2f * step : (step <= 120 ? 8f : 0f);
            if (step > 120) return 0;
            int count = 0;
            uint first = domain[domain.Length / 2];
            foreach (uint node in domain)
            {
                double d2 = 0;
                for (int axis = 0; axis < 3; axis++)
                {
                    double d = (double)positions[3 * node + axis] - positions[3 * first + axis];
                    d2 += d * d;
                }
                if (d2 > 100.0) continue;
                nodes[count] = node;
                vectors[3 * count] = positions[3 * first] < 0 ? depth : -depth;
                vectors[3 * count + 1] = 0f;
                vectors[3 * count + 2] = 0f;
                count++;
            }
            return count;
        }

        [Test]
        public void VersionAndAbiFit()
        {
            Assert.That(Library.Version, Is.StringMatching(@"^\d+\.\d+\.\d+"));
            Assert.That(Native.upt_abi_version(), Is.EqualTo(Native.UPT_ABI_VERSION));
        }

        [Test]
        public void AbiMismatchNamesBothVersions()
        {
            Assert.That(Library.AbiMismatch(7, 7), Is.Null);
            string message = Library.AbiMismatch(9, 7);
            Assert.That(message, Is.StringContaining("9").And.StringContaining("7"));
        }

        [Test]
        public void MissingBundleIsAnExceptionThatNamesThePath()
        {
            string path = "/no/such/brain-\u00e4\u8111";
            UptException error = Assert.Throws<UptException>(() => new Model(path, 1));
            Assert.That(error.Status, Is.EqualTo(Native.UPT_ERR_IO).Or.EqualTo(Native.UPT_ERR_BUNDLE));
            Assert.That(error.Message, Is.StringContaining("brain-\u00e4\u8111"));
        }

        [Test]
        public void BundlePathMayHoldNonAsciiCharacters()
        {
            string folder = Path.Combine(Path.GetTempPath(), "upt-\u00e9\u8133-" + Guid.NewGuid().ToString("N"));
            string name = Path.GetFileName(Bundle.Path);
            try
            {
                // Beside it what it takes from its body.
                foreach (string copied in name == "brain" ? new[] { name } : new[] { name, "brain" })
                {
                    string source = Path.Combine(Path.GetDirectoryName(Bundle.Path), copied);
                    if (!Directory.Exists(source)) continue;
                    Directory.CreateDirectory(Path.Combine(folder, copied));
                    foreach (string file in Directory.GetFiles(source))
                        File.Copy(file, Path.Combine(folder, copied, Path.GetFileName(file)));
                }
                using (Model model = new Model(Path.Combine(folder, name), 1)) Assert.That(model.NodeCount, Is.GreaterThan(0));
            }
            finally
            {
                Directory.Delete(folder, true);
            }
        }

        [Test]
        public void RolloutEqualsTheCHostToTheBit()
        {
            string expected = Environment.GetEnvironmentVariable("UPT_TEST_C_ROLLOUT");
            Assert.That(expected, Is.Not.Null.And.Not.Empty, "UPT_TEST_C_ROLLOUT is not set: run tests/csharp/run.sh");
            using (Model model = new Model(Bundle.Path, 1))
            using (Scene scene = new Scene(model))
            {
                uint[] nodes = new uint[model.NodeCount];
                float[] vectors = new float[3 * model.NodeCount];
                float[] u = new float[3 * model.NodeCount];
                float largest = 0;
                for (int step = 1; step <= 160; step++)
                {
                    int count = Push(model, step, nodes, vectors);
                    scene.Step(StepInput.OfContacts(nodes, vectors, count), u);
                    foreach (float x in u) largest = Math.Max(largest, Math.Abs(x));
                }
                Assert.That(largest, Is.GreaterThan(7.9f), "the contact nodes were pushed by 8 mm");
                byte[] bytes = new byte[4 * u.Length];
                Buffer.BlockCopy(u, 0, bytes, 0, bytes.Length);
                byte[] c = File.ReadAllBytes(expected);
                Assert.That(c.Length, Is.EqualTo(bytes.Length));
                for (int i = 0; i < c.Length; i++)
                    if (c[i] != bytes[i]) Assert.Fail("byte " + i + " of the last state differs from the C host's");
            }
        }

        [Test]
        public void WrongLengthsAreRefusedAndChangeNothing()
        {
            using (Model model = new Model(Bundle.Path, 1))
            using (Scene scene = new Scene(model))
            {
                uint[] nodes = new uint[model.NodeCount];
                float[] vectors = new float[3 * model.NodeCount];
                float[] before = new float[3 * model.NodeCount];
                float[] after = new float[3 * model.NodeCount];
                int count = Push(model, 30, nodes, vectors);
                scene.Step(StepInput.OfContacts(nodes, vectors, count), before);
                Assert.Throws<ArgumentException>(() => scene.StepField(null, new float[3], null));
                Assert.Throws<ArgumentOutOfRangeException>(() => scene.Step(StepInput.OfContacts(new uint[1], new float[3], 2), null));
                Assert.Throws<UptException>(() => scene.Step(StepInput.OfContacts(nodes, vectors, count), new float[5]));
                vectors[0] = float.NaN;
                UptException error = Assert.Throws<UptException>(() => scene.Step(StepInput.OfContacts(nodes, vectors, count), null));
                Assert.That(error.Status, Is.EqualTo(Native.UPT_ERR_NON_FINITE));
                scene.Read(after);
                Assert.That(after, Is.EqualTo(before));
            }
        }

        [Test]
        public void TwoScenesOfOneModelAreIndependent()
        {
            using (Model model = new Model(Bundle.Path, 1))
            using (Scene pushed = new Scene(model))
            using (Scene idle = new Scene(model))
            {
                uint[] nodes = new uint[model.NodeCount];
                float[] vectors = new float[3 * model.NodeCount];
                float[] u = new float[3 * model.NodeCount];
                for (int step = 1; step <= 10; step++)
                {
                    int count = Push(model, step, nodes, vectors);
                    pushed.Step(StepInput.OfContacts(nodes, vectors, count), null);
                    idle.Step(default(StepInput), u);
                }
                foreach (float x in u) Assert.That(x, Is.EqualTo(0f));
                pushed.Read(u);
                float largest = 0;
                foreach (float x in u) largest = Math.Max(largest, Math.Abs(x));
                Assert.That(largest, Is.GreaterThan(1.9f));
            }
        }

        [Test]
        public void DisposeInAnyOrderAndTwice()
        {
            Model model = new Model(Bundle.Path, 1);
            Scene scene = new Scene(model);
            model.Dispose();
            scene.StepField(null, null, null);
            scene.Dispose();
            scene.Dispose();
            model.Dispose();
            Assert.Throws<ObjectDisposedException>(() => scene.StepField(null, null, null));
            Assert.Throws<ObjectDisposedException>(() => new Scene(model));
        }

        [Test]
        public void SubmittedStepEqualsTheDirectOne()
        {
            using (Model model = new Model(Bundle.Path, 1))
            using (Scene direct = new Scene(model))
            using (Scene worker = new Scene(model))
            {
                uint[] nodes = new uint[model.NodeCount];
                float[] vectors = new float[3 * model.NodeCount];
                float[] a = new float[3 * model.NodeCount];
                float[] b = new float[3 * model.NodeCount];
                for (int step = 1; step <= 20; step++)
                {
                    int count = Push(model, step, nodes, vectors);
                    direct.Step(StepInput.OfContacts(nodes, vectors, count), a);
                    worker.Submit(StepInput.OfContacts(nodes, vectors, count));
                    Assert.That(worker.Wait(uint.MaxValue), "the step has finished");
                    worker.Read(b);
                    Assert.That(b, Is.EqualTo(a), "step " + step);
                }
            }
        }

        [Test]
        public void DisposeWhileAStepIsInFlight()
        {
            using (Model model = new Model(Bundle.Path, 1))
            {
                for (int i = 0; i < 20; i++)
                {
                    Scene scene = new Scene(model);
                    uint[] nodes = new uint[model.NodeCount];
                    float[] vectors = new float[3 * model.NodeCount];
                    scene.Submit(StepInput.OfContacts(nodes, vectors, Push(model, 20, nodes, vectors)));
                    scene.Dispose();
                }
            }
        }

        [Test]
        public void SnapshotResumesToTheBit()
        {
            using (Model model = new Model(Bundle.Path, 1))
            using (Scene scene = new Scene(model))
            {
                uint[] nodes = new uint[model.NodeCount];
                float[] vectors = new float[3 * model.NodeCount];
                float[] first = new float[3 * model.NodeCount];
                float[] second = new float[3 * model.NodeCount];
                for (int step = 1; step <= 10; step++)
                    scene.Step(StepInput.OfContacts(nodes, vectors, Push(model, step, nodes, vectors)), null);
                byte[] snapshot = scene.Save();
                int count = Push(model, 11, nodes, vectors);
                scene.Record();
                scene.Step(StepInput.OfContacts(nodes, vectors, count), first);
                scene.Reset();
                scene.Restore(snapshot);
                scene.EndRecord();
                string[] lines = System.Text.Encoding.UTF8.GetString(scene.TakeRecord()).Split('\n');
                Assert.That(lines[0], Is.StringStarting("{\"upt_replay\":2,"));
                Assert.That(lines[2], Is.StringStarting("{\"step\":{\"contact\":{\"nodes\":["));
                Assert.That(lines[3] + lines[5], Is.EqualTo("{\"reset\":{}}{\"end\":4}"));
                Assert.That(scene.TakeRecord(), Is.Empty);
                scene.Step(StepInput.OfContacts(nodes, vectors, count), second);
                Assert.That(second, Is.EqualTo(first));
                snapshot[snapshot.Length / 2] ^= 0x40;
                Assert.Throws<UptException>(() => scene.Restore(snapshot));
            }
        }

        [Test]
        public void TenThousandStepsMakeNoGarbage()
        {
            // What C# allocates for a step does not depend on the body, so a small one.
            using (Model model = new Model(Environment.GetEnvironmentVariable("UPT_TEST_CORRECTED"), 1))
            using (Scene scene = new Scene(model))
            {
                uint[] nodes = new uint[model.NodeCount];
                float[] vectors = new float[3 * model.NodeCount];
                scene.SetRegion(model.Indices(Native.UPT_SET_DOMAIN_NODES));
                float[] region = new float[3 * scene.RegionCount];
                int count = Push(model, 20, nodes, vectors);
                for (int step = 0; step < 100; step++) scene.Step(StepInput.OfContacts(nodes, vectors, count), region);
                GC.Collect();
                GC.WaitForPendingFinalizers();
                int collections = GC.CollectionCount(0);
                long before = GC.GetTotalMemory(true);
                int since = GC.CollectionCount(0);
                for (int step = 0; step < 10000; step++) scene.Step(StepInput.OfContacts(nodes, vectors, count), region);
                long after = GC.GetTotalMemory(false);
                Console.WriteLine("managed bytes over 10,000 steps: " + (after - before) + ", collections: " +
                                  (GC.CollectionCount(0) - since) + " (" + collections + " before)");
                Assert.That(GC.CollectionCount(0), Is.EqualTo(since), "a garbage collection ran");
                Assert.That(after - before, Is.LessThan(64 * 1024));
            }
        }

        [Test]
        public void LogMessagesArriveAndStop()
        {
            int messages = 0;
            Log.Set((level, text) => Interlocked.Increment(ref messages), Native.UPT_LOG_TRACE);
            using (Model model = new Model(Bundle.Path, 1)) Assert.That(model.NodeCount, Is.GreaterThan(0));
            Log.Set(null, 0);
            int heard = messages;
            Assert.That(heard, Is.GreaterThan(0));
            using (Model model = new Model(Bundle.Path, 1)) Assert.That(model.NodeCount, Is.GreaterThan(0));
            Assert.That(messages, Is.EqualTo(heard));
        }

        [Test]
        public void DescriptionIsJsonThatNamesTheBundle()
        {
            using (Model model = new Model(Bundle.Path, 1))
            {
                string text = model.Describe();
                Assert.That(text, Is.StringStarting("{").And.StringContaining("\"name\""));
            }
        }
    }
}
