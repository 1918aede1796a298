#pragma once

// The parts of the module, a file each.

#include <pybind11/pybind11.h>

#include <memory>
#include <mutex>
#include <vector>

#include "transfer/file/transfer_data.h"

namespace rebounce::python {

/// Memory of a product.
struct ProductScratch {
  std::vector<float> light, result;  ///< of a pass
  std::vector<float> turned;         ///< columns that lay side by side
  std::vector<float> workspace;
};

/// Memory that products of several threads take from, and give back to.
class ProductMemory {
 public:
  std::unique_ptr<ProductScratch> take() {
    const std::lock_guard lock(mutex_);
    if (free_.empty()) return std::make_unique<ProductScratch>();
    std::unique_ptr<ProductScratch> scratch = std::move(free_.back());
    free_.pop_back();
    return scratch;
  }

  void give(std::unique_ptr<ProductScratch> scratch) {
    const std::lock_guard lock(mutex_);
    free_.push_back(std::move(scratch));
  }

 private:
  std::mutex mutex_;
  std::vector<std::unique_ptr<ProductScratch>> free_;
};

/// Transfer data that Python holds.
struct Data {
  explicit Data(std::shared_ptr<const TransferData> data) : transfer(std::move(data)) {}

  std::shared_ptr<const TransferData> transfer;
  std::shared_ptr<ProductMemory> memory = std::make_shared<ProductMemory>();

  const TransferData& operator*() const { return *transfer; }
  const TransferData* operator->() const { return transfer.get(); }
};

void add_data(pybind11::module_& module);     // loading, saving, arrays, the product
void add_build(pybind11::module_& module);    // the offline stage
void add_lamps(pybind11::module_& module);    // profiles of luminaires, light files
void add_frame(pybind11::module_& module);    // engines, skies, solvers
void add_facets(pybind11::module_& module);   // view factors of given facets
void add_sensors(pybind11::module_& module);  // light meters

}  // namespace rebounce::python
