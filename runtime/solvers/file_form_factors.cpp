#include "runtime/solvers/file_form_factors.h"

#include <string>

#include "rebounce/error.h"
#include "runtime/solvers/solve_radiosity.h"
#include "transfer/exchange/compressed_form_factors.h"
#include "transfer/exchange/linked_form_factors.h"

namespace rebounce {
namespace {

[[noreturn]] void refuse(const char* missing, const char* option) {
  throw Error(std::string("solver: the transfer file has no ") + missing + "; make it with " +
              option);
}

}  // namespace

std::unique_ptr<const FormFactorOperator> take_form_factors(const TransferData& data,
                                                            SolveMethod method,
                                                            FormFactorSource source) {
  const bool exact = !data.exchange.empty(), compressed = data.compressed_form_factors != nullptr;
  switch (source) {
    case FormFactorSource::kBest:
      if (!exact && !compressed)
        refuse("form factors", "--store-form-factors or --compress-form-factors");
      return make_form_factors(method, data);
    case FormFactorSource::kExact:
      if (!exact) refuse("exact form factors", "--store-form-factors");
      return make_form_factors(method, data);
    case FormFactorSource::kCompressed:
      if (!compressed) refuse("compressed form factors", "--compress-form-factors");
      return std::make_unique<CompressedFormFactors>(data.compressed_form_factors);
    case FormFactorSource::kLinks:
      if (data.links.empty()) refuse("links", "--store-links");
      return std::make_unique<LinkedFormFactors>(data.links, data.patches.area,
                                                 data.patches.centroid);
  }
  throw Error("solver: no such form factors");
}

}  // namespace rebounce
