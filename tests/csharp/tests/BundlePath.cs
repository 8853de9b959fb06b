using System;
using System.IO;
using NUnit.Framework;

namespace Upt.Tests
{
    /// <summary>The real bundle that the tests run on: UPT_TEST_BUNDLE, set by run.sh.</summary>
    internal static class Bundle
    {
        public static string Path
        {
            get
            {
                string path = Environment.GetEnvironmentVariable("UPT_TEST_BUNDLE");
                Assert.That(path, Is.Not.Null.And.Not.Empty, "UPT_TEST_BUNDLE is not set: run tests/csharp/run.sh");
                Assert.That(Directory.Exists(path), "UPT_TEST_BUNDLE: no folder " + path);
                return path;
            }
        }
    }
}
