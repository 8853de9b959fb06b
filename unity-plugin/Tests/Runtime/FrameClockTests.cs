using System;
using NUnit.Framework;
using Upt.Interop;

namespace Upt.Tests
{
    /// <summary>Which steps the clock asks for and with which poses, without a tissue.</summary>
    [TestFixture]
    public sealed class FrameClockTests
    {
        private const double Dt = 0.05;

        private static unsafe upt_instrument At(double x)
        {
            upt_instrument made = default(upt_instrument);
            made.position[0] = (float)x;
            made.rotation[3] = 1f;
            return made;
        }

        private static unsafe float X(upt_instrument instrument)
        {
            return instrument.position[0];
        }

        [TestCase(0)]
        [TestCase(1)]
        [TestCase(5)]
        public void StepsAreMadeForTheirOwnMomentsAtUnevenFrames(int late)
        {
            FrameClock clock = new FrameClock(Dt);
            upt_instrument[] poses = new upt_instrument[1], step = null;
            double now = 3.0;
            int steps = 0, arrival = -1;
            for (int frame = 0; frame < 400; frame++)
            {
                poses[0] = At(10.0 * now);
                clock.Moved(now, poses, 1);
                if (frame == arrival)
                {
                    clock.Finished();
                    arrival = -1;
                }
                Assert.That(clock.Since(now), Is.InRange(0.0, 3.0 * Dt));
                if (clock.IsDue(now))
                {
                    Assert.That(arrival, Is.EqualTo(-1));
                    Assert.That(clock.Start(now, ref step), Is.EqualTo(1));
                    Assert.That(clock.StepTime, Is.EqualTo(3.0 + Dt * steps).Within(1e-9));
                    Assert.That(X(step[0]), Is.EqualTo(10.0 * clock.StepTime).Within(1e-3));
                    Assert.That(clock.IsDue(now), Is.False);
                    steps++;
                    arrival = frame + late;
                    if (late == 0)
                    {
                        clock.Finished();
                        arrival = -1;
                    }
                }
                now += 0.003 + 0.002 * (frame % 5);
            }
            Assert.That(steps, Is.EqualTo((now - 3.0) / Dt).Within(2.0));
        }

        [Test]
        public void AHostThatHangsMakesOneStepWhereItIs()
        {
            FrameClock clock = new FrameClock(Dt);
            upt_instrument[] poses = { At(0.0) }, step = null;
            clock.Moved(0.0, poses, 1);
            clock.Start(0.0, ref step);
            clock.Finished();
            poses[0] = At(10.0);
            clock.Moved(1.0, poses, 1);
            Assert.That(clock.IsDue(1.0));
            clock.Start(1.0, ref step);
            Assert.That(X(step[0]), Is.EqualTo(10f));
            Assert.That(clock.StepTime, Is.EqualTo(1.0));
            clock.Published();
            Assert.That(clock.Since(1.02), Is.EqualTo(0.02).Within(1e-9));
            clock.Finished();
            Assert.That(clock.IsDue(1.049), Is.False);
            Assert.That(clock.IsDue(1.05));
        }

        [Test]
        public void FramesSlowerThanStepsLoseNone()
        {
            const double Short = 0.02;
            FrameClock clock = new FrameClock(Short);
            upt_instrument[] poses = new upt_instrument[1], step = null;
            int steps = 0;
            for (int frame = 0; frame < 60; frame++)
            {
                double now = frame / 30.0;
                poses[0] = At(now);
                clock.Moved(now, poses, 1);
                while (clock.IsDue(now))
                {
                    bool behind = clock.IsBehind(now);
                    clock.Start(now, ref step);
                    Assert.That(X(step[0]), Is.EqualTo(Short * steps).Within(1e-5));
                    clock.Finished();
                    Assert.That(clock.IsDue(now), Is.EqualTo(behind));
                    steps++;
                }
                Assert.That(clock.Since(now), Is.LessThan(Short));
            }
            Assert.That(steps, Is.EqualTo(99), "59 / 30 s and the first");
        }

        [Test]
        public void AnInstrumentThatIsPutElsewhereIsNotBetween()
        {
            FrameClock clock = new FrameClock(Dt);
            upt_instrument[] poses = { At(5000.0) }, step = null;
            clock.Moved(0.0, poses, 1);
            clock.Start(0.0, ref step);
            clock.Finished();
            clock.Moved(0.04, poses, 1);
            poses[0] = At(1.0);
            clock.Moved(0.06, poses, 1);
            clock.Start(0.06, ref step);
            Assert.That(X(step[0]), Is.EqualTo(1f));
        }
    }
}
