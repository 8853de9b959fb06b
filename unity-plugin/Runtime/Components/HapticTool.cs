using System;
using System.Diagnostics;
using System.Threading;
using Upt.Interop;
using UnityEngine;
using Debug = UnityEngine.Debug;

namespace Upt
{
    /// <summary>Where a device's handle is, world axes and units.</summary>
    public struct HapticPose
    {
        /// <summary>Place.</summary>
        public Vector3 position;
        /// <summary>Turn.</summary>
        public Quaternion rotation;
    }

    /// <summary>What the hand is to feel, world axes: on the tool, N; about its position, N m.</summary>
    public struct HapticWrench
    {
        /// <summary>On the tool, N.</summary>
        public Vector3 force;
        /// <summary>About the tool's position, N m.</summary>
        public Vector3 torque;
        /// <summary>Whether the tool touches.</summary>
        public bool contact;
        /// <summary>How old the tissue's last step is, s: a device that hears of seconds should let go.</summary>
        public double age;
    }

    /// <summary>
    /// A hand on an <see cref="Instrument"/>: a thread of its own asks a device for its pose and hands it the wrench, 1,000 times a
    /// second. It knows no device: <see cref="readPose"/> and <see cref="writeWrench"/> are the host's, called on that
    /// thread. A device that has a servo thread of its own calls <see cref="Tick"/> from there instead. The instrument
    /// follows the device in each frame.
    /// </summary>
    [RequireComponent(typeof(Instrument))]
    public sealed class HapticTool : MonoBehaviour
    {
        [Tooltip("The tissue whose list has this instrument.")]
        public SoftTissue tissue;

        [Tooltip("Longest force, N. 0: no limit.")]
        public float forceLimit = 3f;

        [Tooltip("Calls a second of the component's own thread.")]
        public int rate = 1000;

        /// <summary>Where the device is now; seconds since the thread began. Null: the device calls <see cref="Tick"/>.</summary>
        public Func<double, HapticPose> readPose;

        /// <summary>Takes the wrench. A zero one comes last, when the loop ends.</summary>
        public Action<HapticWrench> writeWrench;

        /// <summary>The tissue's place, which the thread may read.</summary>
        private sealed class Place
        {
            public Vector3 position;
            public Quaternion rotation;
            public float unitsPerMillimetre;
        }

        private readonly object turn = new object();
        private volatile Place place;
        private Haptics haptics;
        private Instrument instrument;
        private Thread thread;
        private volatile bool ends;
        private volatile Exception problem;
        private HapticPose last;
        private bool moved;
        private long calls;

        /// <summary>Wrenches so far.</summary>
        public long Calls
        {
            get { return Interlocked.Read(ref calls); }
        }

        /// <summary>Whether a hand can feel the tool.</summary>
        public bool IsRunning
        {
            get { return haptics != null && problem == null; }
        }

        private void OnEnable()
        {
            instrument = GetComponent<Instrument>();
            problem = null;
            moved = false;
        }

        private void OnDisable()
        {
            Stop();
        }

        private void Update()
        {
            if (problem != null && haptics != null)
            {
                Debug.LogError("libupt: haptic tool '" + name + "' stopped: " + problem.Message, this);
                Stop();
                return;
            }
            if (haptics != null && (tissue == null || !tissue.IsRunning)) Stop();
            if (tissue == null || problem != null) return;
            Place now = new Place
            {
                position = tissue.transform.position,
                rotation = tissue.transform.rotation,
                unitsPerMillimetre = tissue.unitsPerMillimetre
            };
            place = now;
            if (haptics == null && !Begin()) return;
            lock (turn)
            {
                if (!moved) return;
                transform.position = last.position;
                transform.rotation = last.rotation;
            }
        }

        /// <summary>The wrench at a device's pose: for a device's own servo thread. Never waits for the tissue, and does not allocate.
        /// <paramref name="seconds"/>: the device's clock, which does not go back. Zero where nothing can be felt.</summary>
        public unsafe HapticWrench Tick(double seconds, HapticPose pose)
        {
            HapticWrench wrench = default(HapticWrench);
            Place at = place;
            Haptics felt = haptics;
            if (at == null || felt == null || problem != null) return wrench;
            Quaternion back = Quaternion.Inverse(at.rotation);
            upt_haptic_pose asked = default(upt_haptic_pose);
            asked.time_s = seconds;
            // Millimetres of the bundle, then metres.
            Anatomical.FromUnity(back * (pose.position - at.position), at.unitsPerMillimetre, asked.position_m);
            for (int k = 0; k < 3; k++) asked.position_m[k] *= 0.001f;
            upt_instrument turned = instrument.TurnedAs(back * pose.rotation);
            for (int k = 0; k < 4; k++) asked.rotation[k] = turned.rotation[k];
            upt_haptic_force force;
            try
            {
                felt.Render(asked, out force);
            }
            catch (Exception error)
            {
                problem = error;
                return wrench;
            }
            wrench.force = at.rotation * Anatomical.ToUnity(force.force_n[0], force.force_n[1], force.force_n[2], 1f);
            // Exchanging two axes turns a cross product round.
            wrench.torque = -(at.rotation * Anatomical.ToUnity(force.torque_n_m[0], force.torque_n_m[1], force.torque_n_m[2], 1f));
            wrench.contact = force.contact != 0;
            wrench.age = force.age_s;
            Interlocked.Increment(ref calls);
            lock (turn)
            {
                last = pose;
                moved = true;
            }
            return wrench;
        }

        private bool Begin()
        {
            if (!isActiveAndEnabled) return false;
            try
            {
                haptics = tissue.MakeHaptics(instrument, forceLimit);
            }
            catch (UptException error)
            {
                problem = error;
                Debug.LogError("libupt: haptic tool '" + name + "' could not start: " + error.Message, this);
            }
            if (haptics == null) return false;
            if (readPose == null) return true;
            ends = false;
            thread = new Thread(Loop) { IsBackground = true, Name = "libupt haptics", Priority = System.Threading.ThreadPriority.Highest };
            thread.Start();
            return true;
        }

        private void Stop()
        {
            ends = true;
            if (thread != null) thread.Join();
            thread = null;
            Haptics felt = haptics;
            haptics = null;
            if (felt != null) felt.Dispose();
        }

        private void Loop()
        {
            Stopwatch clock = Stopwatch.StartNew();
            double period = 1.0 / Math.Max(1, rate), next = 0.0;
            try
            {
                while (!ends && problem == null)
                {
                    double now = clock.Elapsed.TotalSeconds;
                    if (now < next)
                    {
                        // The last part of a millisecond is not slept through: a sleep may take two.
                        if (next - now > 0.0015) Thread.Sleep(1);
                        else Thread.Yield();
                        continue;
                    }
                    // Deadlines that were missed are not made up for.
                    next = Math.Max(next + period, now);
                    HapticWrench wrench = Tick(now, readPose(now));
                    if (writeWrench != null) writeWrench(wrench);
                }
            }
            catch (Exception error)
            {
                problem = error;
            }
            finally
            {
                if (writeWrench != null) writeWrench(default(HapticWrench));
            }
        }
    }
}
