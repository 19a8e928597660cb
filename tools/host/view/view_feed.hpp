// SPDX-License-Identifier: Apache-2.0
/// Threads that make something only while a reader waits for it, always the newest: pictures, and
/// depths of them. A slow reader gets fewer, never old ones.
#ifndef VERGENCE_TOOLS_HOST_VIEW_VIEW_FEED_HPP
#define VERGENCE_TOOLS_HOST_VIEW_VIEW_FEED_HPP

#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>

/// Makes items of `Item`, which has a `number` and an `error`.
template <class Item>
class view_feed {
  public:
    /// `make` returns the next item, or null if there is none for now.
    explicit view_feed(std::function<std::shared_ptr<Item>()> make)
        : make_(std::move(make)), thread_([this] { work(); }) {}
    ~view_feed() {
        stop();
        thread_.join();
    }
    view_feed(const view_feed &) = delete;
    view_feed &operator=(const view_feed &) = delete;

    /// The newest item with a number beyond `after`; null: none within the time, or stopped.
    std::shared_ptr<const Item> newer(std::uint64_t after, std::chrono::milliseconds limit) {
        std::unique_lock<std::mutex> lock(mutex_);
        waiting_++;
        changed_.notify_all();
        changed_.wait_for(lock, limit,
                          [&] { return stopping_ || (newest_ && newest_->number > after); });
        waiting_--;
        return newest_ && newest_->number > after && !stopping_ ? newest_ : nullptr;
    }

    /// Number of the newest item; 0: none.
    std::uint64_t count() {
        const std::lock_guard<std::mutex> lock(mutex_);
        return count_;
    }

    void stop() {
        const std::lock_guard<std::mutex> lock(mutex_);
        stopping_ = true;
        changed_.notify_all();
    }

  private:
    void work() {
        std::unique_lock<std::mutex> lock(mutex_);
        while (!stopping_) {
            if (waiting_ == 0) {
                changed_.wait(lock);
                continue;
            }
            lock.unlock();
            std::shared_ptr<Item> item = make_();
            const bool failed = item == nullptr || !item->error.empty();
            lock.lock();
            if (item != nullptr) {
                item->number = ++count_;
                newest_ = item;
                changed_.notify_all();
            }
            if (failed) {
                constexpr std::chrono::milliseconds pause(300);
                changed_.wait_for(lock, pause, [this] { return stopping_; });
            }
        }
    }

    std::function<std::shared_ptr<Item>()> make_;
    std::mutex mutex_;
    std::condition_variable changed_;
    std::shared_ptr<const Item> newest_;
    std::uint64_t count_ = 0;
    int waiting_ = 0;
    bool stopping_ = false;
    std::thread thread_;
};

#endif
