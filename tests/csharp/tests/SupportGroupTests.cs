using System;
using System.IO;
using System.Security.Cryptography;
using System.Text;
using System.Text.RegularExpressions;
using NUnit.Framework;
using Upt.Interop;

namespace Upt.Tests
{
    /// <summary>Support groups: led as a body and node by node, and let go.</summary>
    [TestFixture]
    public sealed class SupportGroupTests
    {
        private string folder;
        private uint[] held;

        [SetUp]
        public void MakeBundle()
        {
            folder = BundleWithGroup();
            using (Model model = new Model(folder, 1)) held = model.SupportNodes(0);
        }

        /// <summary>The folder of a bundle whose first held nodes are a group.</summary>
        internal static string BundleWithGroup()
        {
            string bundle = Environment.GetEnvironmentVariable("UPT_TEST_CORRECTED");
            Assert.That(bundle, Is.Not.Null.And.Not.Empty, "UPT_TEST_CORRECTED is not set: run tests/csharp/run.sh");
            uint[] held;
            using (Model model = new Model(bundle, 1)) held = model.Indices(Native.UPT_SET_FIXED_NODES);
            Array.Resize(ref held, held.Length / 2);
            string folder = Path.Combine(Path.GetTempPath(), Path.GetRandomFileName());
            Directory.CreateDirectory(folder);
            foreach (string file in Directory.GetFiles(bundle))
                File.Copy(file, Path.Combine(folder, Path.GetFileName(file)));
            string path = Path.Combine(folder, "bundle.json");
            string group = "{\"supports\": [{\"name\": \"ligament\", \"nodes\": [" + string.Join(",", held) + "]}],";
            Regex hash = new Regex("\"manifest_sha256\": *\"[0-9a-f]{64}\"");
            string blank = "\"manifest_sha256\": \"" + new string('0', 64) + "\"";
            string text = hash.Replace(group + File.ReadAllText(path).TrimStart().Substring(1), blank);
            using (SHA256 sha = SHA256.Create())
            {
                byte[] sum = sha.ComputeHash(Encoding.UTF8.GetBytes(text));
                string own = BitConverter.ToString(sum).Replace("-", "").ToLowerInvariant();
                File.WriteAllText(path, text.Replace(blank, blank.Replace(new string('0', 64), own)));
            }
            return folder;
        }

        [TearDown]
        public void RemoveBundle()
        {
            Directory.Delete(folder, true);
        }

        [Test]
        public void AGroupGoesWhereItIsLedAndIsLetGo()
        {
            using (Model model = new Model(folder, 1))
            using (Scene scene = new Scene(model, new upt_scene_options { corrections = Corrections.Count(5) }))
            {
                Assert.That(model.SupportNodes(0), Is.EqualTo(held));
                Assert.Throws<UptException>(() => model.SupportNodes(1));
                float[] field = new float[3 * scene.NodeCount];
                SupportGroup led = new SupportGroup { Position = (0f, 0.1f, 0.2f) };
                StepInput input = new StepInput { SupportGroups = new[] { led } };
                scene.Step(input, field);
                foreach (uint node in held) Assert.That(field[3 * node + 2], Is.EqualTo(0.2f).Within(1e-6f));
                float[] there = new float[3 * held.Length];
                for (int k = 0; k < there.Length; k++) there[k] = 0.1f;
                input.SupportGroups[0] = new SupportGroup { Displacements = there };
                scene.Submit(input);
                Assert.That(scene.Wait(60000));
                scene.Read(field);
                foreach (uint node in held) Assert.That(field[3 * node], Is.EqualTo(0.1f).Within(1e-6f));
                input.SupportGroups[0] = new SupportGroup { LetGo = true };
                input.Gravity = (0f, 0f, -3f);
                for (int step = 0; step < 10; step++) scene.Step(input, field);
                float lowest = 0f;
                foreach (uint node in held) lowest = Math.Min(lowest, field[3 * node + 2]);
                Assert.That(lowest, Is.LessThan(-0.1f));
                input.SupportGroups[0] = new SupportGroup { Group = 1 };
                UptException beyond = Assert.Throws<UptException>(() => scene.Step(input, field));
                Assert.That(beyond.Message, Is.StringContaining("group 1 is beyond"));
                input.SupportGroups[0] = new SupportGroup { Group = -1 };
                Assert.Throws<ArgumentOutOfRangeException>(() => scene.Step(input, field));
                input.SupportGroups = new SupportGroup[65];
                Assert.Throws<ArgumentException>(() => scene.Step(input, field));
            }
        }
    }
}
