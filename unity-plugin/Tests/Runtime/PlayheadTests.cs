using NUnit.Framework;

namespace Upt.Tests
{
    /// <summary>The time at which frames show the tissue, without a tissue. Runs in Unity's test runner and under
    /// Mono.</summary>
    [TestFixture]
    public sealed class PlayheadTests
    {
        private const double Dt = 0.05;

        /// <summary>Shown simulated time, in steps, of each frame when a step arrives <paramref name="late"/> frames
        /// after its submission.</summary>
        private static double[] Shown(int frames, double frameTime, int late)
        {
            Playhead head = new Playhead(Dt);
            double[] shown = new double[frames];
            int last = 0, arrival = -1;
            for (int frame = 0; frame < frames; frame++)
            {
                head.Advance(frameTime);
                if (frame == arrival)
                {
                    last++;
                    head.Landed();
                    arrival = -1;
                }
                shown[frame] = last - 1 + head.Alpha;
                if (arrival >= 0 || !head.IsDue) continue;
                head.Submitted();
                arrival = frame + late;
            }
            return shown;
        }

        [TestCase(60.0, 1)]
        [TestCase(60.0, 2)]
        [TestCase(100.0, 3)]
        public void ShownTimeGoesOnEvenlyWhateverAStepTakes(double rate, int late)
        {
            double[] shown = Shown(400, 1.0 / rate, late);
            double even = 1.0 / rate / Dt;
            for (int frame = 60; frame < shown.Length; frame++)
                Assert.That(shown[frame] - shown[frame - 1], Is.EqualTo(even).Within(1e-6), "frame " + frame);
        }

        // A step is no whole number of frames, so it arrives up to a frame later or earlier than the last one did.
        [TestCase(72.0, 1)]
        [TestCase(90.0, 3)]
        [TestCase(144.0, 1)]
        public void ShownTimeNeverStopsNorLeapsAtOtherFrameRates(double rate, int late)
        {
            double[] shown = Shown(800, 1.0 / rate, late);
            double even = 1.0 / rate / Dt;
            for (int frame = 60; frame < shown.Length; frame++)
                Assert.That(shown[frame] - shown[frame - 1], Is.InRange(0.02 * even, 2.0 * even), "frame " + frame);
            Assert.That(shown[799] - shown[59], Is.EqualTo(740 * even).Within(even));
        }

        [Test]
        public void StepsSlowerThanTheirOwnTimeAreShownWithoutGoingBack()
        {
            double[] shown = Shown(200, 1.0 / 60.0, 5);
            for (int frame = 1; frame < shown.Length; frame++)
                Assert.That(shown[frame], Is.GreaterThanOrEqualTo(shown[frame - 1] - 1e-9), "frame " + frame);
            // A step is asked for in the frame that takes the last one, so one comes every five frames, and that many are shown.
            Assert.That(shown[199] - shown[49], Is.EqualTo(150 / 5).Within(1.0), "the picture goes on");
        }

        [Test]
        public void ARefusedStepHoldsTheLastState()
        {
            Playhead head = new Playhead(Dt);
            head.Advance(Dt);
            head.Submitted();
            head.Refused();
            Assert.That(head.Alpha, Is.EqualTo(1.0));
            head.Advance(Dt);
            head.Submitted();
            Assert.That(head.Alpha, Is.EqualTo(1.0), "the state before would be a leap back");
            head.Advance(1.0 / 60.0);
            head.Landed();
            Assert.That(head.Alpha, Is.LessThan(0.5));
        }
    }
}
