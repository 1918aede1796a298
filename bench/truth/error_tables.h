#pragma once

// Tables of where the pipeline and the path tracer differ.

#include <filesystem>
#include <span>

#include "bench/reference/compare.h"
#include "bench/truth/error_causes.h"
#include "transfer/file/transfer_data.h"

namespace rebounce::reference {

/// Writes a row for each compared patch of `table`: what it is, its indirect irradiance [n], the
/// truth; and what one bounce brings, unless `bounce` is empty.
void write_patch_table(const std::filesystem::path& path, const PatchTable& table,
                       const PatchComparison& compared, std::span<const Float3> indirect_irradiance,
                       const OneBounce& bounce);

/// Writes a row for each compared one of `points`: where it is, what is shown there, the truth.
void write_point_table(const std::filesystem::path& path, const TransferData& data,
                       std::span<const SurfacePoint> points, const IrradianceEstimate& truth,
                       const ReconstructionComparison& compared);

}  // namespace rebounce::reference
