#pragma once

// Links of patches, once they gather.

#include <memory>

#include "precompute/exchange/links/link_fitting.h"
#include "transfer/exchange/linked_form_factors.h"
#include "transfer/file/transfer_data.h"

namespace rebounce::test {

inline std::shared_ptr<const LinkedFormFactors> gathering(const FormFactorLinks& links,
                                                          const PatchTable& patches) {
  return std::make_shared<const LinkedFormFactors>(links, patches.area, patches.centroid);
}

/// As few links as are enough for the pairs that `links` stand for.
inline FormFactorLinks fewer_links(const FormFactorLinks& links, const PatchTable& patches,
                                   double error_per_link = kErrorPerLink) {
  return fit_links(gathering(links, patches), patches, error_per_link);
}

}  // namespace rebounce::test
