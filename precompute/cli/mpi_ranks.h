#pragma once

#include <exception>
#include <memory>

#include "precompute/base/ranks.h"

namespace rebounce::cli {

/// The processes that mpirun has begun.
class MpiRanks : public Communicator {
 public:
  /// Ends all of them with `status`, whatever they do.
  virtual void abort(int status) = 0;
};

/// Joins them, once in a process, until the object ends. Null if mpirun has not begun this process
/// or the program is built without MPI.
std::unique_ptr<MpiRanks> join_ranks();

/// Prints in one line why a rank cannot go on, and ends all ranks with status 1. What stops every
/// rank alike, as a bad file does, only rank 0 prints.
[[noreturn]] void end_all(MpiRanks& ranks, const std::exception& error);

}  // namespace rebounce::cli
