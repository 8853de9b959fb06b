using System;
using System.IO;
using System.Threading;
using NUnit.Framework;
using Upt.Samples;
using UnityEngine;

namespace Upt.Tests
{
    /// <summary>A simulated device on a tissue, on a stub of the engine.</summary>
    [TestFixture]
    public sealed class HapticToolTests
    {
        private static PushedBrain Brain()
        {
            GameObject item = new GameObject("brain");
            item.SetActive(false);
            PushedBrain sample = item.AddComponent<PushedBrain>();
            sample.model = ScriptableObject.CreateInstance<UptModel>();
            sample.model.bundlePath = Path.GetFullPath(Bundle.Path);
            sample.model.threads = 1;
            item.SetActive(true);
            if (!sample.Tissue.Presents) Assert.Ignore("the test bundle has no corrections");
            Debug.Errors.Clear();
            return sample;
        }

        /// <summary>A tool on the sample's spatula.</summary>
        private static HapticTool Tool(PushedBrain sample)
        {
            GameObject item = sample.Tissue.instruments[0].gameObject;
            HapticTool tool = item.AddComponent<HapticTool>();
            tool.tissue = sample.Tissue;
            return tool;
        }

        [Test]
        public void AServoCallbackFeelsThePushAndNothingInTheAir()
        {
            PushedBrain sample = Brain();
            SoftTissue tissue = sample.Tissue;
            HapticTool tool = Tool(sample);
            tool.gameObject.Send("OnEnable");
            tool.gameObject.Send("Update");
            Assert.That(Debug.Errors, Is.Empty);
            Assert.That(tool.IsRunning);
            Vector3 outward = tool.transform.rotation * new Vector3(0f, 0f, 1f);
            double seconds = 0.0;
            float largest = 0f, along = 0f, air = 1f;
            for (int frame = 0; frame < 120; frame++)
            {
                sample.gameObject.Send("Update");
                Vector3 position = tool.transform.position;
                Quaternion rotation = tool.transform.rotation;
                outward = rotation * new Vector3(0f, 0f, 1f);
                for (int tick = 0; tick < 16; tick++)
                {
                    seconds += 0.001;
                    HapticWrench wrench = tool.Tick(seconds, new HapticPose { position = position, rotation = rotation });
                    if (frame == 0) air = wrench.force.magnitude;
                    if (wrench.force.magnitude <= largest) continue;
                    largest = wrench.force.magnitude;
                    along = Vector3.Dot(wrench.force, outward);
                }
                tissue.gameObject.Send("Update");
                Thread.Sleep(5);
            }
            Assert.That(Debug.Errors, Is.Empty);
            Assert.That(air, Is.EqualTo(0f));
            Assert.That(largest, Is.InRange(0.001f, 3f), "N");
            Assert.That(along, Is.GreaterThan(0.5f * largest), "the tissue pushes the tool out");
            Assert.That(tool.Calls, Is.EqualTo(120 * 16));
            // A tissue that is gone is no force, and no error.
            sample.gameObject.SetActive(false);
            tool.gameObject.Send("Update");
            Assert.That(tool.IsRunning, Is.False);
            HapticWrench after = tool.Tick(seconds + 1.0, new HapticPose { rotation = tool.transform.rotation });
            Assert.That(after.force.magnitude, Is.EqualTo(0f));
            Assert.That(Debug.Errors, Is.Empty);
        }

        [Test]
        public void ASimulatedDeviceIsServedByAThreadOfItsOwnAndLetGoAtTheEnd()
        {
            PushedBrain sample = Brain();
            HapticTool tool = Tool(sample);
            HapticPose held = new HapticPose { position = tool.transform.position, rotation = tool.transform.rotation };
            long reads = 0;
            HapticWrench last = default(HapticWrench);
            last.age = -1.0;
            tool.readPose = seconds =>
            {
                Interlocked.Increment(ref reads);
                return held;
            };
            tool.writeWrench = wrench => last = wrench;
            tool.gameObject.Send("OnEnable");
            for (int frame = 0; frame < 400 && Interlocked.Read(ref reads) < 50; frame++)
            {
                tool.gameObject.Send("Update");
                sample.Tissue.gameObject.Send("Update");
                Thread.Sleep(5);
            }
            Assert.That(Debug.Errors, Is.Empty);
            Assert.That(Interlocked.Read(ref reads), Is.GreaterThanOrEqualTo(50));
            tool.gameObject.Send("OnDisable");
            long stopped = Interlocked.Read(ref reads);
            Thread.Sleep(20);
            Assert.That(Interlocked.Read(ref reads), Is.EqualTo(stopped), "the thread has ended");
            Assert.That(last.force.magnitude, Is.EqualTo(0f));
            Assert.That(last.contact, Is.False);
            sample.gameObject.SetActive(false);
        }

        [Test]
        public void TheSampleBuildsItsSceneAndTheHandFeelsTheBrain()
        {
            GameObject item = new GameObject("felt brain");
            item.SetActive(false);
            FeltBrain sample = item.AddComponent<FeltBrain>();
            sample.model = ScriptableObject.CreateInstance<UptModel>();
            sample.model.bundlePath = Path.GetFullPath(Bundle.Path);
            sample.model.threads = 1;
            Debug.Errors.Clear();
            item.SetActive(true);
            Assert.That(Debug.Errors, Is.Empty);
            if (!sample.Tissue.Presents) Assert.Ignore("the test bundle has no corrections");
            sample.Probe.period = 0.4f;
            float largest = 0f;
            for (int frame = 0; frame < 1000 && largest < 0.01f; frame++)
            {
                sample.Probe.gameObject.Send("Update");
                sample.Tissue.gameObject.Send("Update");
                largest = Math.Max(largest, sample.Probe.Force.magnitude);
                Thread.Sleep(5);
            }
            Assert.That(Debug.Errors, Is.Empty);
            Assert.That(largest, Is.GreaterThanOrEqualTo(0.01f), "N");
            HapticProbe probe = sample.Probe;
            item.SetActive(false);
            Assert.That(probe.GetComponent<HapticTool>().IsRunning, Is.False);
            Assert.That(Debug.Errors, Is.Empty);
        }

        [Test]
        public void AFaultInTheDevicesCodeStopsTheForceAndIsReported()
        {
            PushedBrain sample = Brain();
            HapticTool tool = Tool(sample);
            HapticWrench last = default(HapticWrench);
            last.force = new Vector3(1f, 0f, 0f);
            tool.readPose = seconds => { throw new InvalidOperationException("unplugged"); };
            tool.writeWrench = wrench => last = wrench;
            tool.gameObject.Send("OnEnable");
            for (int frame = 0; frame < 200 && Debug.Errors.Count == 0; frame++)
            {
                tool.gameObject.Send("Update");
                Thread.Sleep(5);
            }
            Assert.That(Debug.Errors.Count, Is.EqualTo(1));
            Assert.That(last.force.magnitude, Is.EqualTo(0f));
            Assert.That(tool.IsRunning, Is.False);
            sample.gameObject.SetActive(false);
        }
    }
}
