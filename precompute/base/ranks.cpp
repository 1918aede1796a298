#include "precompute/base/ranks.h"

#include <utility>

namespace rebounce {
namespace {

thread_local Communicator* current = nullptr;

}  // namespace

CommunicatorScope::CommunicatorScope(Communicator* communicator)
    : before_(std::exchange(current, communicator)) {}

CommunicatorScope::~CommunicatorScope() {
  current = before_;
}

Ranks::Ranks() : communicator_(current) {}

void Ranks::broadcast(std::span<std::byte> bytes, std::size_t root) const {
  if (communicator_ != nullptr && !bytes.empty()) communicator_->broadcast(bytes, root);
}

}  // namespace rebounce
