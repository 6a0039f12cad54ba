"""Planning scores by name: the field's definitions beside exact ones; numpy and shapely in, numbers out."""
