using NUnit.Framework;
using UnityEngine;

namespace Upt.Tests
{
    // What a tissue says of its trained domain, at rest.
    public sealed partial class ComponentTests
    {
        [Test]
        public void TheMiddleOfTheDomainLiesAmongItsCornersAndItsNormalPointsOut()
        {
            SoftTissue tissue = Tissue();
            Vector3 middle, outward;
            tissue.DomainMiddle(out middle, out outward);
            Assert.That(middle, Is.EqualTo(Vector3.zero));
            Assert.That(outward, Is.EqualTo(Vector3.up));
            tissue.gameObject.SetActive(true);
            tissue.DomainMiddle(out middle, out outward);
            Assert.That(outward.magnitude, Is.EqualTo(1f).Within(1e-5f));
            float nearest = float.MaxValue;
            float along = 0f;
            foreach (Vector3 corner in tissue.DomainPoints())
            {
                nearest = System.Math.Min(nearest, (corner - middle).magnitude);
                along += Vector3.Dot(corner - middle, outward);
            }
            // Half the edge of a triangle, and a brain's domain curves away from its middle.
            Assert.That(nearest, Is.LessThan(0.006f));
            Assert.That(along, Is.LessThan(0f));
            tissue.gameObject.SetActive(false);
        }

        [Test]
        public void TheDomainsBorderIsClosed()
        {
            SoftTissue tissue = Tissue();
            tissue.gameObject.SetActive(true);
            Vector3[] ends = tissue.DomainOutline();
            Assert.That(ends.Length, Is.GreaterThan(6).And.LessThan(tissue.DomainPoints().Length));
            // Each corner of a closed line is met an even number of times.
            var met = new System.Collections.Generic.Dictionary<Vector3, int>();
            foreach (Vector3 end in ends) met[end] = met.ContainsKey(end) ? met[end] + 1 : 1;
            foreach (int times in met.Values) Assert.That(times % 2, Is.EqualTo(0));
            tissue.gameObject.SetActive(false);
        }
    }
}
