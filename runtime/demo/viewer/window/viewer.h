#pragma once

#include <functional>
#include <memory>

#include "rebounce/sky.h"
#include "runtime/demo/image/images.h"
#include "runtime/demo/viewer/window/viewer_setup.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// Opens a window and returns when it is closed, or when `keep_open`, called before every frame,
/// returns false. Throws Error if there is no display or no OpenGL 3.3.
void run_viewer(const std::shared_ptr<const TransferData>& data, const ViewerSetup& setup,
                const std::function<bool()>& keep_open);

/// Draws the same pictures without a window or display, at `frame_count` times that are 1 /
/// `frames_per_second` seconds apart, from 0 on. Calls `take` with each picture and its number.
/// Returns the median times. Throws Error if there is no OpenGL 3.3, or as `take` does.
StageTimes draw_viewer_frames(const std::shared_ptr<const TransferData>& data,
                              const ViewerSetup& setup, int frame_count, float frames_per_second,
                              const std::function<void(int, const ScreenImage&)>& take);

}  // namespace rebounce
