using System;
using NUnit.Framework;
using Upt.Interop;

namespace Upt.Tests
{
    /// <summary>Ties: a thread that pulls and breaks, and a bed.</summary>
    [TestFixture]
    public sealed unsafe class TieTests
    {
        [Test]
        public void AThreadPullsByItsStiffnessAndBreaks()
        {
            string bundle = Environment.GetEnvironmentVariable("UPT_TEST_CORRECTED");
            Assert.That(bundle, Is.Not.Null.And.Not.Empty, "UPT_TEST_CORRECTED is not set: run tests/csharp/run.sh");
            using (Model model = new Model(bundle, 1))
            using (Scene scene = new Scene(model, new upt_scene_options { corrections = Corrections.Count(5) }))
            {
                float[] rest = model.Positions();
                uint[] domain = model.Indices(Native.UPT_SET_DOMAIN_NODES);
                uint node = domain[domain.Length / 2];
                float x = rest[3 * node], y = rest[3 * node + 1], z = rest[3 * node + 2];
                upt_bed bed = new upt_bed { radius_mm = 15f, stiffness = 20f, break_mn = 1000f };
                bed.centre[0] = x;
                bed.centre[1] = y;
                bed.centre[2] = z;
                upt_tie[] ties = scene.Bed(bed);
                Assert.That(ties.Length, Is.GreaterThan(2));
                int last = ties.Length;
                Array.Resize(ref ties, last + 1);
                upt_tie thread = scene.TieAt(x, y, z);
                thread.place[2] = z + 3f;
                thread.stiffness = 5f;
                thread.slack_mm = 1f;
                ties[last] = thread;
                StepInput input = new StepInput { Ties = ties };
                float[] field = new float[3 * scene.NodeCount];
                for (int step = 0; step < 5; step++) scene.Step(input, field);
                upt_tie_reading pulled = scene.TieReadings(ties.Length)[last];
                Assert.That(pulled.force[2], Is.GreaterThan(0.1f));
                Assert.That(pulled.force[2], Is.EqualTo(5f * (pulled.length_mm - 1f)).Within(0.1f));
                ties[last].break_mn = 0.5f * pulled.force[2];
                scene.Submit(input);
                Assert.That(scene.Wait(60000));
                Assert.That(scene.TieReadings(ties.Length)[last].broke, Is.EqualTo(1));
                ties[0].stiffness = -1f;
                Assert.Throws<UptException>(() => scene.Step(input, field));
                Assert.Throws<UptException>(() => scene.TieReadings(1));
            }
        }
    }
}
