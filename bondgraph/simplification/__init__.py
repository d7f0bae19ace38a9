"""The rules that leave a graph with fewer bonds, and the method that writes one; `causal` checks what it wrote."""
