//! Which providers a model asks for, in order.

use super::backend::Sessions;
use super::choice::ProviderChoice;
use crate::error::{Error, Result};
use crate::options::{ModelOptions, Provider};

/// Which providers to try for a session, in order, with their options.
#[derive(Debug, Clone)]
pub struct ProviderPlan {
    pub(super) options: ModelOptions,
    /// Shared by the clones of a plan.
    #[cfg_attr(not(feature = "learned"), expect(dead_code))]
    pub(super) sessions: Sessions,
}

impl ProviderPlan {
    /// The plan of a model's options.
    pub fn new(options: &ModelOptions) -> ProviderPlan {
        let mut options = options.clone();
        let order = &mut options.providers;
        if order.is_empty() || (options.fallback && !order.contains(&Provider::Cpu)) {
            order.push(Provider::Cpu);
        }
        ProviderPlan {
            options,
            sessions: Sessions::default(),
        }
    }

    /// The CPU alone.
    pub fn cpu() -> ProviderPlan {
        ProviderPlan::new(&ModelOptions::default())
    }

    /// What a bundle without any graph runs on: the CPU, if the list allows it.
    ///
    /// # Errors
    /// [`Error::Provider`] when it does not.
    pub fn without_graph(&self, bundle: &str) -> Result<ProviderChoice> {
        let reason = || format!("{bundle} has no graph to run there");
        let wanted = self.options.providers.iter();
        let refused = wanted
            .take_while(|&&provider| provider != Provider::Cpu)
            .map(|&provider| (provider, reason()))
            .collect();
        if !self.options.providers.contains(&Provider::Cpu) {
            return Err(Error::Provider(format!(
                "{}; add the CPU to the providers",
                reason()
            )));
        }
        Ok(ProviderChoice {
            refused,
            ..ProviderChoice::cpu()
        })
    }
}
