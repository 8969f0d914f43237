//! What draws.

use bregma_renderer::{CpuRenderer, GpuError, GpuRenderer, RenderError, Renderer, named};

named! {
    /// What shall draw.
    #[derive(Default)]
    pub enum Machine {
        /// A hardware GPU if there is one, else the CPU.
        #[default]
        Auto = "auto",
        /// The CPU.
        Cpu = "cpu",
        /// Any GPU, even a software driver.
        Gpu = "gpu",
    }
}

impl Machine {
    /// The GPU, if there is one and it is not left out; with `any`, `Auto` takes a software driver too. Fails only if `Gpu` finds none.
    pub fn gpu(self, any: bool) -> Result<Option<GpuRenderer>, RenderError> {
        match self {
            Self::Auto => Ok(GpuRenderer::new(any).ok()),
            Self::Cpu => Ok(None),
            Self::Gpu => Ok(Some(GpuRenderer::new(true)?)),
        }
    }

    /// The renderer. Fails only if `Gpu` finds none.
    pub fn renderer(self) -> Result<Box<dyn Renderer>, RenderError> {
        Ok(self.gpu(false)?.map_or_else(cpu, boxed))
    }

    /// All that can be compared, the CPU first: `Cpu` and `Gpu` are alone; with `any`, `Auto` takes a software driver too.
    pub fn renderers(self, any: bool) -> Result<Vec<Box<dyn Renderer>>, RenderError> {
        let gpu = self.gpu(any)?.map(boxed);
        Ok((self != Self::Gpu).then(cpu).into_iter().chain(gpu).collect())
    }

    /// What `Auto` draws by, and why that is no GPU where there is one.
    pub fn auto() -> (Box<dyn Renderer>, Option<GpuError>) {
        match GpuRenderer::new(false) {
            Ok(gpu) => (boxed(gpu), None),
            Err(GpuError::NoAdapter) => (cpu(), None),
            Err(error) => (cpu(), Some(error)),
        }
    }
}

fn cpu() -> Box<dyn Renderer> {
    Box::new(CpuRenderer::default())
}

fn boxed(gpu: GpuRenderer) -> Box<dyn Renderer> {
    Box::new(gpu)
}
