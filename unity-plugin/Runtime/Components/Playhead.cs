using System;

namespace Upt
{
    /// <summary>
    /// When a step is due, and where between the last two states a frame is shown. A submitted step
    /// arrives some frames later; the picture runs that much behind, so that the step's arrival neither stops
    /// the motion nor throws it back.
    /// </summary>
    internal struct Playhead
    {
        /// <summary>How fast the delay follows steps that arrive earlier than it, a step.</summary>
        private const double DelayDecay = 0.02;

        private readonly double dt;
        private double sinceSubmit;
        private double delay;
        private bool landed;
        private bool held;

        /// <summary>At rest, for a model with a step of <paramref name="dt"/> seconds.</summary>
        public Playhead(double dt)
        {
            this.dt = dt;
            sinceSubmit = 0.0;
            delay = 0.0;
            landed = true;
            held = false;
        }

        /// <summary>The model's step, seconds.</summary>
        public double Step
        {
            get { return dt; }
        }

        /// <summary>True when it is time for the next step.</summary>
        public bool IsDue
        {
            get { return sinceSubmit >= dt; }
        }

        /// <summary>Goes on by a frame's time.</summary>
        public void Advance(double seconds)
        {
            sinceSubmit += seconds;
        }

        /// <summary>A step was submitted. A frame that took longer than a step does not ask for two: the tissue
        /// would run after the clock.</summary>
        public void Submitted()
        {
            sinceSubmit = Math.Min(sinceSubmit - dt, dt);
            landed = false;
        }

        /// <summary>The submitted step's state is the last one now.</summary>
        public void Landed()
        {
            double late = Math.Min(sinceSubmit, dt);
            delay = late > delay ? late : delay + DelayDecay * (late - delay);
            landed = true;
            held = false;
        }

        /// <summary>The submitted step gave no state: the last one is shown until another arrives.</summary>
        public void Refused()
        {
            held = true;
        }

        /// <summary>0: the state before the last, 1: the last.</summary>
        public double Alpha
        {
            get
            {
                if (held) return 1.0;
                double alpha = (sinceSubmit - delay) / dt + (landed ? 0.0 : 1.0);
                return Math.Max(0.0, Math.Min(1.0, alpha));
            }
        }
    }
}
