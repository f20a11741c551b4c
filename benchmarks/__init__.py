"""The measurements that the documentation states; ``python -m benchmarks.<name>`` repeats one of them."""
