using System;

namespace Upt.Interop
{
    /// <summary>
    /// The input of a step or a frame: what drives it. By default nothing does, and the tissue moves on by itself. The
    /// arrays are the caller's; calls read them and keep none.
    /// </summary>
    public unsafe struct StepInput
    {
        /// <summary>Rigid instruments where they are at the end of the step; the first <see cref="InstrumentCount"/>
        /// count.</summary>
        public upt_instrument[] Instruments;

        /// <summary>Number of instruments.</summary>
        public int InstrumentCount;

        /// <summary>Nodes in contact; the first <see cref="ContactCount"/> count.</summary>
        public uint[] ContactNodes;

        /// <summary><c>[ContactCount,3]</c>, mm: their displacement at the end of the step.</summary>
        public float[] ContactVectors;

        /// <summary>Number of nodes in contact.</summary>
        public int ContactCount;

        /// <summary><c>[K,3]</c>, mm, zero but at nodes in contact; null: no such field.</summary>
        public float[] Collision;

        /// <summary><c>[K,3]</c>, mm: what the step starts from; null: the scene's own state.</summary>
        public float[] Displacement;

        /// <summary>The moment of the end of the step on a clock of the caller's, s.</summary>
        public double Time;

        /// <summary><c>[K,3]</c>, mN: forces on the nodes at the end of the step; null: none. Loads act in scenes with
        /// corrections.</summary>
        public float[] Forces;

        /// <summary>Forces at points of the tissue (<see cref="Model.Locate"/>), at most 256, beside
        /// <see cref="Forces"/>.</summary>
        public upt_point_force[] PointForces;

        /// <summary>Pressure on parts of the surface, at most 32.</summary>
        public Pressure[] Pressures;

        /// <summary>Ties of the tissue, at most 256, each with its <c>struct_size</c>: every tie in every step, in the same
        /// order. Not in scenes without corrections.</summary>
        public upt_tie[] Ties;

        /// <summary>Gravity at the end of the step, m/s², in the mesh's frame: x, y, z. Not in scenes without
        /// corrections.</summary>
        public (float X, float Y, float Z) Gravity;

        /// <summary>Gravity under which the mesh was scanned, m/s²: the difference acts. Zeros: the
        /// bundle's.</summary>
        public (float X, float Y, float Z) GravityAtRest;

        /// <summary>The first <paramref name="count"/> instruments drive the step.</summary>
        public static StepInput OfInstruments(upt_instrument[] instruments, int count)
        {
            return new StepInput { Instruments = instruments, InstrumentCount = count };
        }

        /// <summary>The first <paramref name="count"/> entries of a contact list.</summary>
        public static StepInput OfContacts(uint[] nodes, float[] vectors, int count)
        {
            return new StepInput { ContactNodes = nodes, ContactVectors = vectors, ContactCount = count };
        }

        /// <summary>A collision field.</summary>
        public static StepInput OfField(float[] collision)
        {
            return new StepInput { Collision = collision };
        }

        /// <summary>Where what holds the body is at the end of the step, mm: in every step, where it moves. All else stays in
        /// the mesh's frame, which goes with it, but gravity, which is the world's then.</summary>
        public (float X, float Y, float Z) SupportPosition;

        /// <summary>Its rotation, a unit quaternion; all zero: it does not move.</summary>
        public (float X, float Y, float Z, float W) SupportRotation;

        /// <summary>What support groups of the bundle do, each at most once and in every step; at most 64.</summary>
        public SupportGroup[] SupportGroups;

        /// <summary>Refuses counts that the arrays do not hold, and fields of another size than <c>[K,3]</c>.</summary>
        internal void Require(int nodeCount)
        {
            RequireCount(InstrumentCount, Instruments == null ? 0 : Instruments.Length, "InstrumentCount");
            int room = Math.Min(ContactNodes == null ? 0 : ContactNodes.Length,
                                ContactVectors == null ? 0 : ContactVectors.Length / 3);
            RequireCount(ContactCount, room, "ContactCount");
            RequireField(Collision, nodeCount, "Collision");
            RequireField(Displacement, nodeCount, "Displacement");
            RequireField(Forces, nodeCount, "Forces");
            RequireMost(Pressures, PinnedLists.MostPressures, "Pressures");
            RequireMost(SupportGroups, PinnedLists.MostGroups, "SupportGroups");
            for (int i = 0; SupportGroups != null && i < SupportGroups.Length; i++)
                if (SupportGroups[i].Group < 0)
                    throw new ArgumentOutOfRangeException(
                        "SupportGroups", "SupportGroups[" + i + "].Group is " + SupportGroups[i].Group + ", must be 0 or more");
        }

        /// <summary>As the library's struct, with the arrays where they are pinned.</summary>
        internal upt_input Raw(upt_instrument* instruments, uint* nodes, float* vectors, float* collision,
                               float* displacement, float* forces, upt_pressure* pressures, upt_tie* ties,
                               upt_support* supports, upt_point_force* pointForces)
        {
            upt_input raw = default(upt_input);
            raw.struct_size = (uint)sizeof(upt_input);
            raw.instruments = instruments;
            raw.instrument_count = (ulong)InstrumentCount;
            raw.contact_nodes = nodes;
            raw.contact_vectors = vectors;
            raw.contact_count = (ulong)ContactCount;
            raw.collision = collision;
            raw.displacement = displacement;
            raw.time_s = Time;
            raw.forces = forces;
            raw.pressures = pressures;
            raw.pressure_count = (ulong)(Pressures == null ? 0 : Pressures.Length);
            raw.ties = ties;
            raw.tie_count = (ulong)(Ties == null ? 0 : Ties.Length);
            raw.supports = supports;
            raw.support_count = (ulong)(SupportGroups == null ? 0 : SupportGroups.Length);
            raw.point_forces = pointForces;
            raw.point_force_count = (ulong)(PointForces == null ? 0 : PointForces.Length);
            raw.gravity[0] = Gravity.X;
            raw.gravity[1] = Gravity.Y;
            raw.gravity[2] = Gravity.Z;
            raw.gravity_at_rest[0] = GravityAtRest.X;
            raw.gravity_at_rest[1] = GravityAtRest.Y;
            raw.gravity_at_rest[2] = GravityAtRest.Z;
            raw.support_position[0] = SupportPosition.X;
            raw.support_position[1] = SupportPosition.Y;
            raw.support_position[2] = SupportPosition.Z;
            raw.support_rotation[0] = SupportRotation.X;
            raw.support_rotation[1] = SupportRotation.Y;
            raw.support_rotation[2] = SupportRotation.Z;
            raw.support_rotation[3] = SupportRotation.W;
            return raw;
        }

        private static void RequireCount(int count, int room, string parameter)
        {
            if (count < 0 || count > room)
                throw new ArgumentOutOfRangeException(
                    parameter, parameter + " is " + count + ", the arrays hold " + room + " entries");
        }

        private static void RequireMost(Array list, int most, string parameter)
        {
            if (list != null && list.Length > most)
                throw new ArgumentException(
                    parameter + " holds " + list.Length + " entries, at most " + most, parameter);
        }

        private static void RequireField(float[] field, int nodeCount, string parameter)
        {
            if (field != null && field.Length != 3 * nodeCount)
                throw new ArgumentException(
                    parameter + " holds " + field.Length + " floats, the mesh has " + nodeCount + " nodes (" +
                        3 * nodeCount + " floats)",
                    parameter);
        }
    }
}
