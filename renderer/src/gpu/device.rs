//! Finding a graphics card, and noticing when it fails.

use std::sync::{Arc, Mutex};
use std::time::Duration;
use thiserror::Error;

/// Why the GPU does not draw.
#[derive(Debug, Error)]
pub enum GpuError {
    /// Neither a graphics card nor a software driver.
    #[error("no graphics adapter was found; install a Vulkan, Metal or DirectX 12 driver, or use --backend cpu")]
    NoAdapter,
    /// The adapter is there but gives no device.
    #[error("the graphics adapter {adapter} refuses to work ({reason}); update its driver, or use --backend cpu")]
    NoDevice {
        /// The adapter's name.
        adapter: String,
        /// The driver's words.
        reason: String,
    },
    /// A volume with more samples along a side than the adapter's 3D textures have.
    #[error("the scan is {}×{}×{} samples but {adapter} holds at most {limit} along a side; use --backend cpu", dims[0], dims[1], dims[2])]
    TooLarge {
        /// Samples of the scan.
        dims: [usize; 3],
        /// The adapter's limit.
        limit: u32,
        /// The adapter's name.
        adapter: String,
    },
    /// A picture larger than the adapter's buffers.
    #[error(
        "a picture of {width}×{height} pixels is larger than the {limit}×{limit} that {adapter} draws; use --backend cpu or a smaller --size"
    )]
    PictureTooLarge {
        /// Pixels across.
        width: u32,
        /// Pixels down.
        height: u32,
        /// The side of the largest square.
        limit: u32,
        /// The adapter's name.
        adapter: String,
    },
    /// More volumes in one scene than a pixel of a picture can name.
    #[error("{count} volumes are in the scene but the graphics adapter draws at most {most} at once; remove some, or use --backend cpu")]
    TooManyVolumes {
        /// Volumes in the scene.
        count: usize,
        /// The limit.
        most: usize,
    },
    /// The memory of the graphics card is full.
    #[error("{adapter} has no room for the {mib} MiB of the scan; close other programs or use --backend cpu")]
    Memory {
        /// Size of the texture that did not fit.
        mib: usize,
        /// The adapter's name.
        adapter: String,
    },
    /// A driver that ends loops which take long, as llvmpipe does after 65,535 rounds.
    #[error(
        "{adapter} gave up on long rays, as drivers in software do: use --backend cpu, or fewer steps, or more opaque surfaces without shadows"
    )]
    Unfinished {
        /// The adapter.
        adapter: String,
    },
    /// An adapter without a filter for float32 textures.
    #[error("{adapter} cannot filter textures of float32, which the solver filter is; use another --solver")]
    NoFilter {
        /// The adapter's name.
        adapter: String,
    },
    /// The driver reported an error, reset the device or did not answer in time.
    #[error("{adapter} stopped working ({reason}); try again, or use --backend cpu")]
    Failed {
        /// The adapter's name.
        adapter: String,
        /// The driver's words.
        reason: String,
    },
}

/// A device and what went wrong with it.
#[derive(Clone, Debug)]
pub(super) struct Gpu {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    pub info: wgpu::AdapterInfo,
    failure: Arc<Mutex<Option<String>>>,
}

/// Longer than any batch of blocks on the slowest software driver, short enough that a hung driver is reported.
const TIMEOUT: Duration = Duration::from_secs(60);

impl Gpu {
    /// Opens the fastest adapter; a software driver only if `software` allows it.
    pub fn open(software: bool) -> Result<Self, GpuError> {
        if !software && !may_have_card() {
            return Err(GpuError::NoAdapter);
        }
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle().with_env());
        let options = wgpu::RequestAdapterOptions { power_preference: wgpu::PowerPreference::HighPerformance, ..Default::default() };
        let adapter = pollster::block_on(instance.request_adapter(&options)).map_err(|_| GpuError::NoAdapter)?;
        let info = adapter.get_info();
        if info.device_type == wgpu::DeviceType::Cpu && !software {
            return Err(GpuError::NoAdapter);
        }
        // The adapter's own limits: the defaults stop at 2,048 samples and 128 MiB, whatever the card can do.
        let request = wgpu::DeviceDescriptor {
            label: Some("bregma"),
            // What the solver `filter` asks for, and a clock; nothing else.
            required_features: adapter.features() & (wgpu::Features::FLOAT32_FILTERABLE | wgpu::Features::TIMESTAMP_QUERY),
            required_limits: adapter.limits(),
            ..Default::default()
        };
        let refused = |e: wgpu::RequestDeviceError| GpuError::NoDevice { adapter: info.name.clone(), reason: e.to_string() };
        let (device, queue) = pollster::block_on(adapter.request_device(&request)).map_err(refused)?;
        let failure = Arc::new(Mutex::new(None));
        let note = |failure: &Arc<Mutex<Option<String>>>, text: String| {
            if let Ok(mut slot) = failure.lock() {
                slot.get_or_insert(text);
            }
        };
        let (on_error, on_loss) = (Arc::clone(&failure), Arc::clone(&failure));
        device.on_uncaptured_error(Arc::new(move |error| note(&on_error, one_line(&error.to_string()))));
        device.set_device_lost_callback(move |_, message| note(&on_loss, one_line(&message)));
        Ok(Self { device, queue, info, failure })
    }

    /// Backend and adapter, for people and records.
    pub fn name(&self) -> String {
        let software = if self.info.device_type == wgpu::DeviceType::Cpu { ", a software driver" } else { "" };
        format!("{:?}, {}{software}", self.info.backend, self.info.name)
    }

    /// Whether textures of float32 can be filtered.
    pub fn filters_f32(&self) -> bool {
        self.device.features().contains(wgpu::Features::FLOAT32_FILTERABLE)
    }

    /// Waits until the submitted work is done; reports what failed on the way.
    pub fn wait(&self) -> Result<(), GpuError> {
        let waited = self.device.poll(wgpu::PollType::Wait { submission_index: None, timeout: Some(TIMEOUT) });
        let noted = self.failure.lock().ok().and_then(|mut slot| slot.take());
        match (noted, waited) {
            (Some(reason), _) => Err(self.failed(reason)),
            (None, Err(e)) => Err(self.failed(e.to_string())),
            (None, Ok(_)) => Ok(()),
        }
    }

    /// Waits for the submitted work, and gives the bytes of `buffer` to `read`.
    pub fn read_buffer<T>(&self, buffer: &wgpu::Buffer, read: impl FnOnce(&[u8]) -> T) -> Result<T, GpuError> {
        let (sender, receiver) = std::sync::mpsc::channel();
        // The receiver outlives the wait below; a send to nobody would mean the wait failed, which is reported.
        buffer.map_async(wgpu::MapMode::Read, .., move |mapped| drop(sender.send(mapped)));
        self.wait()?;
        receiver.try_recv().map_err(|e| self.failed(e.to_string()))?.map_err(|e| self.failed(e.to_string()))?;
        let value = read(&buffer.get_mapped_range(..).map_err(|e| self.failed(e.to_string()))?);
        buffer.unmap();
        Ok(value)
    }

    pub fn failed(&self, reason: String) -> GpuError {
        GpuError::Failed { adapter: self.info.name.clone(), reason }
    }
}

/// On Linux every graphics card shows as one of these devices. Without one the driver loader need not be asked, which takes time and,
/// on a machine without a desktop, complains on standard error.
fn may_have_card() -> bool {
    !cfg!(target_os = "linux") || ["/dev/dri", "/dev/nvidiactl", "/dev/dxg"].iter().any(|device| std::path::Path::new(device).exists())
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
