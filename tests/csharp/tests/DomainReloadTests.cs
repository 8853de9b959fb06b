using System;
using System.IO;
using NUnit.Framework;
using Upt.Interop;

namespace Upt.Tests
{
    /// <summary>The editor unloads the scripting domain on each compilation, with whatever runs in it. Mono can do the
    /// same here: a second domain opens a model, submits a step, hears the log and is unloaded.</summary>
    [TestFixture]
    public sealed class DomainReloadTests
    {
        /// <summary>Runs in the domain that is unloaded; nothing is disposed. Static, so that it is called there.</summary>
        private static void LeaveAStepInFlight()
        {
            Log.Set((level, text) => { }, Native.UPT_LOG_TRACE);
            Model model = new Model(Bundle.Path, 1);
            Scene scene = new Scene(model);
            uint node = model.Indices(Native.UPT_SET_DOMAIN_NODES)[0];
            scene.Submit(StepInput.OfContacts(new[] { node }, new[] { 1f, 0f, 0f }, 1));
            AppDomain.CurrentDomain.SetData("scene", scene);
        }

        [Test]
        public void UnloadedDomainsLeaveTheLibraryUsableAndEmpty()
        {
            AppDomainSetup setup = new AppDomainSetup();
            setup.ApplicationBase = Path.GetDirectoryName(typeof(DomainReloadTests).Assembly.Location);
            for (int turn = 0; turn < 3; turn++)
            {
                AppDomain domain = AppDomain.CreateDomain("reload " + turn, null, setup);
                domain.DoCallBack(LeaveAStepInFlight);
                AppDomain.Unload(domain);
                // The log's receiver is gone with its domain: a message now must not reach for it.
                using (Model model = new Model(Bundle.Path, 1))
                using (Scene scene = new Scene(model))
                {
                    scene.StepField(null, null, null);
                    Assert.That(scene.Stats().step_count, Is.EqualTo(1));
                }
            }
            GC.Collect();
            GC.WaitForPendingFinalizers();
            // Refused while models or scenes live: those of the unloaded domains were closed.
            Library.Shutdown();
        }
    }
}
