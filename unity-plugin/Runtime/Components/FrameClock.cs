using System;
using Upt.Interop;

namespace Upt
{
    /// <summary>
    /// When a step is due, with which poses, and how long ago the last published one was: what a host that presents has to
    /// know. A step is made for every <c>dt</c> of the host's time with the poses of its own moment, between those of the two
    /// frames around it. A host that hangs for more than 0.1 s or two steps goes on from where it is. Allocates only where
    /// a list grows.
    /// </summary>
    internal sealed class FrameClock
    {
        /// <summary>Frames whose poses are kept: those since the next step's moment, while a step is in flight.</summary>
        private const int Kept = 64;

        /// <summary>An instrument that moves farther from a frame to the next has been put there, mm.</summary>
        private const float Put = 40f;

        /// <summary>A host that was away for longer does not make up for it, seconds.</summary>
        private const double Lost = 0.1;

        private struct Frame
        {
            public double time;
            public int count;
            public upt_instrument[] poses;
        }

        private readonly double dt;
        private readonly Frame[] frames = new Frame[Kept];
        private int first;
        private int used;
        private double next;
        private double step;
        private double published;
        private bool started;
        private bool inFlight;

        /// <summary>At rest, for a scene with a step of <paramref name="dt"/> seconds.</summary>
        public FrameClock(double dt)
        {
            this.dt = dt;
        }

        /// <summary>The scene's step, seconds.</summary>
        public double Step
        {
            get { return dt; }
        }

        /// <summary>The moment of the step that was submitted last, seconds.</summary>
        public double StepTime
        {
            get { return step; }
        }

        /// <summary>The first <paramref name="count"/> instruments are here at <paramref name="now"/>, which does not go
        /// back.</summary>
        public void Moved(double now, upt_instrument[] poses, int count)
        {
            if (!started)
            {
                started = true;
                next = now;
                published = now;
            }
            if (used == Kept) Forget();
            int at = (first + used) % Kept;
            if (frames[at].poses == null || frames[at].poses.Length < count)
                frames[at].poses = new upt_instrument[poses.Length];
            Array.Copy(poses, frames[at].poses, count);
            frames[at].time = now;
            frames[at].count = count;
            used++;
        }

        /// <summary>True when the next step is due.</summary>
        public bool IsDue(double now)
        {
            return started && !inFlight && now + 1e-9 >= next;
        }

        /// <summary>True when another step is due after that: frames come slower than steps.</summary>
        public bool IsBehind(double now)
        {
            return IsDue(now) && now + 1e-9 >= next + dt;
        }

        /// <summary>A step is submitted: fills <paramref name="poses"/> with the instruments at its moment and gives
        /// their number.</summary>
        public int Start(double now, ref upt_instrument[] poses)
        {
            if (now - next > Math.Max(2.0 * dt, Lost)) next = now;
            int count = Place(next, ref poses);
            step = next;
            next += dt;
            inFlight = true;
            return count;
        }

        /// <summary>The submitted step's state can be seen, though it has not been taken yet.</summary>
        public void Published()
        {
            published = step;
        }

        /// <summary>The submitted step is over, with a state or without: the last one is that of its moment.</summary>
        public void Finished()
        {
            inFlight = false;
            published = step;
        }

        /// <summary>Seconds since the moment of the last published step.</summary>
        public double Since(double now)
        {
            return Math.Max(0.0, now - published);
        }

        private void Forget()
        {
            first = (first + 1) % Kept;
            used--;
        }

        private int Place(double time, ref upt_instrument[] poses)
        {
            while (used > 2 && frames[(first + 1) % Kept].time <= time) Forget();
            Frame from = frames[first];
            Frame to = used > 1 && time > from.time ? frames[(first + 1) % Kept] : from;
            if (poses == null || poses.Length < to.count) poses = new upt_instrument[to.poses.Length];
            Array.Copy(to.poses, poses, to.count);
            double way = to.time - from.time;
            double part = way > 0.0 ? (time - from.time) / way : 1.0;
            if (from.count == to.count && part < 1.0)
                for (int i = 0; i < to.count; i++) Blend(ref from.poses[i], (float)part, ref poses[i]);
            return to.count;
        }

        private static unsafe void Blend(ref upt_instrument start, float part, ref upt_instrument end)
        {
            fixed (float* a = start.position)
            fixed (float* b = end.position)
            {
                float far = 0f;
                for (int k = 0; k < 3; k++) far = Math.Max(far, Math.Abs(b[k] - a[k]));
                if (far > Put) return;
                for (int k = 0; k < 3; k++) b[k] = a[k] + part * (b[k] - a[k]);
            }
            fixed (float* a = start.rotation)
            fixed (float* b = end.rotation)
            {
                float dot = 0f, length = 0f;
                for (int k = 0; k < 4; k++) dot += a[k] * b[k];
                for (int k = 0; k < 4; k++)
                {
                    float from = dot < 0f ? -a[k] : a[k];
                    b[k] = from + part * (b[k] - from);
                    length += b[k] * b[k];
                }
                float size = (float)Math.Sqrt(length);
                for (int k = 0; k < 4; k++) b[k] /= size;
            }
        }
    }
}
