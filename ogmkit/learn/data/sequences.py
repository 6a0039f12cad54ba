"""Sequence samples: six images of a camera, a step apart, with the trajectory of the last."""

from torch import Tensor

from ogmkit.learn.data.frames import FrameDataset
from ogmkit.learn.data.tensors import per_frame_tensors, positions_tensor, trajectory_tensors
from ogmkit.samples.arrays import SampleArrays


class SequenceDataset(FrameDataset):
    """Sequences t = −5 … 0 of shards; the index comes from `index_sequences`.

    A sample is a dictionary as of `FrameDataset`: what belongs to an image has a leading axis of 6, oldest
    first; `past`, `future` and `trajectory_valid` are the last frame's. Where the trajectory is asked for,
    there is also

    - `positions`: (6, 2) float32 metres, the ego at the six images in the last one's level frame, whose own
      is (0, 0).

    All six images of a sequence are augmented alike.
    """

    def _tensors(self, arrays: SampleArrays) -> dict[str, Tensor]:
        whole = per_frame_tensors(arrays, self.own_grid, self._factor)
        return whole | trajectory_tensors(arrays) | positions_tensor(arrays)
