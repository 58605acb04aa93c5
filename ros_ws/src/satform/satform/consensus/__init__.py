"""What satellites agree on, and with whom: communication graphs and consensus laws."""
