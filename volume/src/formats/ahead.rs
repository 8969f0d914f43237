//! Reading ahead: one thread reads and unpacks while another takes what is there.

use super::{ReadError, Sink};
use std::sync::mpsc::{channel, sync_channel};

/// Pieces that are ready and not yet taken.
const READY: usize = 2;

/// Passes what `stream` gives on to `take`, which runs meanwhile; gives what `stream` gives.
pub fn ahead<T: Send>(stream: impl FnOnce(&mut Sink<'_>) -> Result<T, ReadError> + Send, take: &mut Sink<'_>) -> Result<T, ReadError> {
    let (ready, pieces) = sync_channel::<Vec<u8>>(READY);
    // Buffers go back, as fresh memory costs as much as reading.
    let (back, used) = channel::<Vec<u8>>();
    std::thread::scope(|scope| {
        let reader = scope.spawn(move || {
            stream(&mut |bytes| {
                let mut piece = used.try_recv().unwrap_or_default();
                piece.clear();
                piece.extend_from_slice(bytes);
                // Nobody takes any more: what stopped that is the error.
                ready.send(piece).map_err(|_| ReadError::Cancelled(crate::progress::Cancelled))
            })
        });
        for piece in pieces {
            take(&piece)?;
            // The reader may be done.
            let _ = back.send(piece);
        }
        match reader.join() {
            Ok(streamed) => streamed,
            Err(panic) => std::panic::resume_unwind(panic),
        }
    })
}
