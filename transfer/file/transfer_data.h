#pragma once

// The contents of a transfer file in memory: patches, display mesh, form factors, operator, and the
// record of how they were made. transfer_file.h reads and writes it.

#include <memory>
#include <string>

#include "rebounce/scene_data.h"
#include "transfer/exchange/exchange_matrix.h"
#include "transfer/exchange/linked_form_factors.h"
#include "transfer/operator/transfer_operator.h"

namespace rebounce {

class HierarchicalOperator;

/// How light goes from patch to patch, beside the scene.
struct TransferData : SceneData {
  /// F M_e [n] in lx: the irradiance directly from emitters. Empty if nothing emits, or if F is
  /// stored and gives it.
  std::vector<Float3> emitted_irradiance;
  /// F by pairs of patches. Empty if pairs are not stored: then use compressed_form_factors.
  ExchangeMatrix exchange;
  /// G = A^1/2 F A^-1/2 compressed, one matrix for the three channels (CompressedFormFactors). Null
  /// if it is not stored.
  std::shared_ptr<const HierarchicalOperator> compressed_form_factors;
  FormFactorLinks links;  ///< empty unless they were requested
  std::shared_ptr<const TransferOperator> transfer;
  std::string settings_json;  ///< every setting of the build, one JSON object
  std::string report_json;    ///< what the build found, no times: one JSON object
};

}  // namespace rebounce
