using Upt.Interop;
using UnityEngine;

namespace Upt
{
    /// <summary>What the tissue did to an instrument at the end of the last finished step.</summary>
    public struct InstrumentReading
    {
        /// <summary>Force on the instrument, mN, world axes.</summary>
        public Vector3 force;

        /// <summary>Torque on the instrument about its position, mN mm, world axes.</summary>
        public Vector3 torque;

        /// <summary>How deep tissue lies inside of the instrument, mm.</summary>
        public float penetration;

        /// <summary>Points of the surface that push or hold the instrument.</summary>
        public int contactCount;

        /// <summary>Its grasp tore off in this step.</summary>
        public bool torn;

        internal static unsafe InstrumentReading From(upt_instrument_reading reading, Quaternion tissue)
        {
            InstrumentReading told = default(InstrumentReading);
            told.force = tissue * Anatomical.ToUnity(reading.force[0], reading.force[1], reading.force[2], 1f);
            // Exchanging two axes turns a cross product round.
            told.torque = -(tissue * Anatomical.ToUnity(reading.torque[0], reading.torque[1], reading.torque[2], 1f));
            told.penetration = reading.penetration_mm;
            told.contactCount = (int)reading.contact_count;
            told.torn = reading.torn != 0;
            return told;
        }
    }
}
